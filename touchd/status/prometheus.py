"""The status in Prometheus' text exposition format, version 0.0.4.

Format: https://prometheus.io/docs/instrumenting/exposition_formats/; names and base units as in
https://prometheus.io/docs/practices/naming/.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

from touchd.align.alignment import AreaOrigin
from touchd.model import State
from touchd.status.data import OutputFacts, SourceFacts, Status, SurfaceFacts

Sample: TypeAlias = tuple[Mapping[str, str], float | None]


@dataclass(frozen=True, slots=True)
class Metric:
    """A metric and its samples: labels and value; a sample whose value is None is left out."""

    name: str
    kind: Literal["gauge", "counter"]
    text: str
    samples: Sequence[Sample]


def prometheus(status: Status) -> str:
    """Return the page that Prometheus scrapes."""
    metrics = [
        *_process(status),
        *_state(status),
        *_source(status.source),
        *(_surface(status.surface) if status.surface is not None else ()),
        *_area(status),
        *_outputs(status.outputs),
    ]
    return "".join(line for metric in metrics for line in _lines(metric))


def _process(status: Status) -> list[Metric]:
    labels = {"version": status.version, "source": status.source.name, "source_kind": status.source.kind}
    refused, unkept = status.config.problem is not None, status.not_kept is not None
    return [
        Metric("touchd_info", "gauge", "Always 1; what runs is in the labels.", [(labels, 1)]),
        _gauge("touchd_start_time_seconds", "When the daemon was started, in Unix time.", status.started_s),
        _gauge("touchd_resident_memory_bytes", "Resident memory of the daemon.", status.memory_bytes),
        _gauge("touchd_config_refused", "1 if the last edit of the config was refused.", refused),
        _gauge("touchd_state_not_kept", "1 if the state folder could not be written.", unkept),
    ]


def _state(status: Status) -> list[Metric]:
    states: list[Sample] = [({"state": state.value}, status.state is state) for state in State]
    return [
        Metric("touchd_state", "gauge", "1 for the state that the daemon is in.", states),
        _gauge("touchd_state_start_time_seconds", "When the state began, in Unix time.", status.state_since_s),
        _gauge("touchd_cursors", "Touches on the surface now.", status.cursors),
        _counter("touchd_touches_total", "Touches that began since the start.", status.touches),
    ]


def _source(source: SourceFacts) -> list[Metric]:
    latencies: list[Sample] = [
        ({"statistic": "p50"}, _milli(source.latency_p50_ms)),
        ({"statistic": "p99"}, _milli(source.latency_p99_ms)),
        ({"statistic": "max"}, _milli(source.latency_max_ms)),
    ]
    return [
        _counter("touchd_frames_total", "Depth frames worked on since the start.", source.frames),
        _counter("touchd_frames_dropped_total", "Depth frames dropped for want of time.", source.dropped),
        _gauge("touchd_frames_per_second", "Depth frames a second over the last ten seconds.", source.fps),
        Metric(
            "touchd_frame_latency_seconds",
            "gauge",
            "Time from a frame's arrival to its touches' being sent, over the last ten seconds.",
            latencies,
        ),
        _counter("touchd_source_reconnects_total", "How often the source was connected anew.", source.reconnects),
        _gauge(
            "touchd_source_packet_loss_ratio",
            "Share of the source's packets that were lost over the last ten seconds.",
            source.packet_loss,
        ),
    ]


def _surface(surface: SurfaceFacts) -> list[Metric]:
    return [
        _gauge("touchd_surface_learned_time_seconds", "When the surface was learned, in Unix time.", surface.made_s),
        _gauge("touchd_surface_usable_ratio", "Share of the area that can see touches.", surface.coverage),
        _gauge("touchd_surface_moved_ratio", "Share of the area masked because something moved.", surface.moved),
        _gauge("touchd_surface_noise_meters", "Median noise of the depth.", _milli(surface.noise_mm)),
        _gauge("touchd_surface_flatness_meters", "Distance from the best plane, rms.", _milli(surface.flatness_mm)),
        _gauge("touchd_surface_distance_meters", "Distance from the camera.", _milli(surface.distance_mm)),
        _gauge("touchd_surface_tilt_degrees", "Between the camera's axis and the surface's normal.", surface.tilt_deg),
        _gauge(
            "touchd_surface_drift_meters", "How far it reads from where it was learned, rms.", _milli(surface.drift_mm)
        ),
        _counter("touchd_surface_moves_total", "How often camera or table were moved since the start.", surface.moves),
        _gauge("touchd_surface_problems", "How many things the surface's report complains of.", len(surface.problems)),
    ]


def _area(status: Status) -> list[Metric]:
    if status.area is None:
        return []
    origins: list[Sample] = [({"origin": origin.value}, status.area.origin is origin) for origin in AreaOrigin]
    return [
        Metric("touchd_area_origin", "gauge", "1 for where the area in force comes from.", origins),
        _gauge("touchd_area_residual_meters", "How well the aligned points agree.", _milli(status.area.residual_mm)),
    ]


def _outputs(outputs: Sequence[OutputFacts]) -> list[Metric]:
    sent: list[Sample] = []
    failed: list[Sample] = []
    dropped: list[Sample] = []
    for place, output in enumerate(outputs):
        # The place tells outputs apart that are otherwise the same.
        labels = {"output": str(place), "name": output.name}
        dropped.append((labels, output.dropped))
        if not output.destinations:
            sent.append((labels, output.sent))
            failed.append((labels, output.failed))
        for other, one in enumerate(output.destinations):
            of_one = {**labels, "destination": one.destination, "destination_index": str(other)}
            sent.append((of_one, one.sent))
            failed.append((of_one, one.failed))
    return [
        Metric("touchd_output_sent_total", "counter", "Datagrams or lines sent.", sent),
        Metric("touchd_output_failed_total", "counter", "Datagrams or lines refused by the system.", failed),
        Metric("touchd_output_dropped_total", "counter", "Frames dropped by an output for want of room.", dropped),
    ]


def _gauge(name: str, text: str, value: float | None) -> Metric:
    return Metric(name, "gauge", text, [({}, value)])


def _counter(name: str, text: str, value: float) -> Metric:
    return Metric(name, "counter", text, [({}, value)])


def _milli(value: float | None) -> float | None:
    return None if value is None else value / 1e3


def _lines(metric: Metric) -> list[str]:
    samples = [
        f"{metric.name}{_braced(labels)} {_number(value)}\n" for labels, value in metric.samples if value is not None
    ]
    if not samples:
        return []
    return [f"# HELP {metric.name} {metric.text}\n", f"# TYPE {metric.name} {metric.kind}\n", *samples]


def _braced(labels: Mapping[str, str]) -> str:
    if not labels:
        return ""
    return "{" + ",".join(f'{name}="{_escaped(value)}"' for name, value in labels.items()) + "}"


def _escaped(value: str) -> str:
    return value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _number(value: float) -> str:
    return str(int(value)) if isinstance(value, int) else repr(value)
