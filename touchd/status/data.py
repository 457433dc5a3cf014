"""Everything that a running daemon tells about itself, and its way through JSON."""

import json
import math
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter, ValidationError

from touchd.align.alignment import AreaOrigin
from touchd.contacts.aim import EyeOffsets
from touchd.errors import StateError
from touchd.metrics import MetricsSnapshot
from touchd.model import State
from touchd.outputs.output import OutputStatus
from touchd.outputs.udp import DestinationStatus

if TYPE_CHECKING:
    from touchd.surface.living import Vitals
    from touchd.surface.quality import SurfaceReport


@dataclass(frozen=True, slots=True)
class ConfigFacts:
    """The config in force. ``problem`` is the text of the last edit if that was refused, and when that was."""

    path: str | None  # None for the defaults
    problem: str | None = None
    problem_since_s: float | None = None  # Unix time


@dataclass(frozen=True, slots=True)
class SourceFacts:
    """Where frames come from and how they flow; see :class:`touchd.metrics.MetricsSnapshot`."""

    name: str
    kind: str
    waiting: str | None  # what it knowingly waits for
    reconnects: int
    frames: int
    fps: float | None
    dropped: int
    dropped_lately: int  # in the last minute
    latency_p50_ms: float | None
    latency_p99_ms: float | None
    latency_max_ms: float | None
    packet_loss: float | None = None  # share of the source's packets lost in the last 10 s; None where not known


@dataclass(frozen=True, slots=True)
class SurfaceFacts:
    """The surface in force: see :class:`touchd.surface.quality.SurfaceReport`. None where nothing was measured."""

    made_s: float | None  # Unix time
    made_from: str
    coverage: float | None
    noise_mm: float | None
    near_mm: float | None
    far_mm: float | None
    flatness_mm: float | None
    tilt_deg: float | None
    distance_mm: float | None
    moved: float | None
    problems: tuple[str, ...]
    drift_mm: float | None = None  # since it was learned, as far as that is followed; None where it is not
    moves: int = 0  # how often camera or table were moved since the start


@dataclass(frozen=True, slots=True)
class AreaFacts:
    """The active area in force. ``notes`` are sentences about it that a user should read.

    ``eye_mm``: how far ahead of their touch people aim, if touches are told so.
    """

    origin: AreaOrigin
    size_mm: tuple[float, float] | None
    residual_mm: float | None  # of the alignment, if that is in force
    notes: tuple[str, ...] = ()
    eye_mm: EyeOffsets | None = None


@dataclass(frozen=True, slots=True)
class DestinationFacts:
    """How one destination of an output fares since the start, in datagrams."""

    destination: str
    address: str | None  # None while its name has none
    sent: int
    failed: int
    last_error: str | None


@dataclass(frozen=True, slots=True)
class OutputFacts:
    """How an output fares since the start, in datagrams or lines."""

    name: str
    sent: int
    failed: int
    dropped: int
    troubled_lately: int  # failed or dropped in the last minute
    last_error: str | None
    destinations: tuple[DestinationFacts, ...] = ()


@dataclass(frozen=True, slots=True)
class Status:
    """How the daemon fares at ``time_s``. All ``_s`` that say when something was are Unix time."""

    version: str
    pid: int
    time_s: float
    started_s: float
    memory_bytes: int | None  # resident
    state: State | None  # None before the first frame
    state_since_s: float
    why: str | None
    cursors: int
    touches: int  # begun since the start
    config: ConfigFacts
    not_kept: str | None  # why something could not be stored in the state folder
    source: SourceFacts
    surface: SurfaceFacts | None
    area: AreaFacts | None
    outputs: tuple[OutputFacts, ...]

    @property
    def uptime_s(self) -> float:
        """How long the daemon has been running."""
        return max(0.0, self.time_s - self.started_s)

    def as_json(self) -> dict[str, Any]:
        """Return the status for :func:`json.dumps`: keys are never renamed, numbers that are not finite are None."""
        plain: dict[str, Any] = _plain({**asdict(self), "uptime_s": self.uptime_s})
        return plain


def status_from_json(content: object) -> Status:
    """Return the status that :meth:`Status.as_json` gave. What this version does not know is left out.

    Raises StateError if something is missing or is not what it should be.
    """
    try:
        return TypeAdapter(Status).validate_json(json.dumps(content))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise StateError(
            f"the status is not one that this touchd understands ({where}: {first['msg']}); "
            "is the daemon of another version? restart it"
        ) from error


def source_facts(
    name: str,
    kind: str,
    waiting: str | None,
    reconnects: int,
    metrics: MetricsSnapshot,
    dropped_lately: int,
    packet_loss: float | None,
) -> SourceFacts:
    """Return the facts of a source with its frames' metrics."""
    return SourceFacts(
        name=name,
        kind=kind,
        waiting=waiting,
        reconnects=reconnects,
        frames=metrics.frames,
        fps=metrics.fps,
        dropped=metrics.dropped,
        dropped_lately=dropped_lately,
        latency_p50_ms=metrics.latency_p50_ms,
        latency_p99_ms=metrics.latency_p99_ms,
        latency_max_ms=metrics.latency_max_ms,
        packet_loss=packet_loss,
    )


def surface_facts(
    report: "SurfaceReport", made_from: str, made_s: float | None, vitals: "Vitals | None"
) -> SurfaceFacts:
    """Return the facts of a surface from its report; what that could not measure is None.

    ``vitals``: how it has fared since it was learned, None where it is not followed.
    """
    return SurfaceFacts(
        made_s=made_s,
        made_from=made_from,
        coverage=_known(report.coverage),
        noise_mm=_known(report.noise_mm),
        near_mm=_known(report.near_mm),
        far_mm=_known(report.far_mm),
        flatness_mm=_known(report.flatness_mm),
        tilt_deg=_known(report.tilt_deg),
        distance_mm=_known(report.distance_mm),
        moved=_known(report.moved),
        problems=report.problems,
        drift_mm=None if vitals is None else _known(vitals.drift_mm),
        moves=0 if vitals is None else vitals.moves,
    )


def output_facts(
    status: OutputStatus, destinations: tuple[DestinationStatus, ...], troubled_lately: int
) -> OutputFacts:
    """Return the facts of an output and its destinations, of which it may have none."""
    return OutputFacts(
        name=status.name,
        sent=status.sent,
        failed=status.failed,
        dropped=status.dropped,
        troubled_lately=troubled_lately,
        last_error=status.last_error,
        destinations=tuple(
            DestinationFacts(one.destination, one.address, one.sent, one.failed, one.last_error) for one in destinations
        ),
    )


def _known(figure: float) -> float | None:
    return figure if math.isfinite(figure) else None


def _plain(value: Any) -> Any:
    """Return a value made of what JSON knows."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, StrEnum):
        return value.value
    if isinstance(value, str):
        # A path may hold bytes that are no UTF-8; Python keeps them as surrogates, which JSON readers refuse.
        return value.encode("utf-8", "backslashreplace").decode("utf-8")
    return _known(value) if isinstance(value, float) else value
