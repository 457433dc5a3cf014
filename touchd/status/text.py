"""The status in words: for people, for one line, and as a verdict."""

from collections.abc import Iterator

from touchd.align.alignment import AreaOrigin
from touchd.contacts.aim import EyeOffsets
from touchd.model import State
from touchd.sources.source import PACKET_LOSS_REMEDY, PACKET_LOSS_WORTH_TELLING
from touchd.status.data import AreaFacts, OutputFacts, SourceFacts, Status, SurfaceFacts

_LONG_CALIBRATION_S = 60.0
_DROPPED_SHARE = 0.02  # of the last minute's frames: more are worth a warning
_SHOWN_PACKET_LOSS = 0.001  # less is not worth a line
_LABEL_WIDTH = 10
_VERDICTS = ("ok", "warning", "critical")
_ORIGINS = {
    AreaOrigin.CONFIG: "from the config's corners_px",
    AreaOrigin.ALIGNMENT: "from touchd align",
    AreaOrigin.SOURCE: "from the source, which knows it",
    AreaOrigin.GUESSED: "guessed",
    AreaOrigin.WHOLE_PICTURE: "the whole picture",
}


def status_lines(status: Status) -> list[str]:
    """Return the status as lines for people; what is wrong is marked with an exclamation mark."""
    sections = [
        ("state", _state_lines(status)),
        ("source", _source_lines(status.source)),
        ("touches", [f"{status.cursors} now, {_grouped(status.touches)} since the start"]),
        ("surface", _surface_lines(status.surface, status.time_s)),
        ("area", _area_lines(status.area)),
        *((("outputs" if place == 0 else ""), _output_lines(output)) for place, output in enumerate(status.outputs)),
        ("config", _config_lines(status)),
        ("process", _process_lines(status)),
    ]
    return [
        f"{label if place == 0 else '':<{_LABEL_WIDTH}}{line}"
        for label, lines in sections
        for place, line in enumerate(lines)
    ]


def sentence(status: Status) -> str:
    """Return the status as one line: what it is doing, and what is wrong in a few words."""
    remarks = [
        *(["the config's last edit was refused"] if status.config.problem is not None else []),
        *(["the state folder cannot be written"] if status.not_kept is not None else []),
        *(["an output fails"] if any(output.troubled_lately for output in status.outputs) else []),
        *(["the surface is poor"] if status.surface is not None and status.surface.problems else []),
        *(status.area.notes if status.area is not None else ()),
    ]
    return "; ".join([_doing(status), *remarks])


def check(status: Status) -> tuple[int, str]:
    """Return a verdict for monitoring, 0 for ok, 1 for a warning and 2 for critical, and a sentence that says why."""
    critical, warnings = list(_critical(status)), list(_warnings(status))
    verdict = 2 if critical else 1 if warnings else 0
    reasons = [*critical, *warnings] or [_doing(status)]
    return verdict, f"{_VERDICTS[verdict]}: {'; '.join(reasons)}"


def unreachable(why: str) -> tuple[int, str]:
    """Return the verdict of :func:`check` for a daemon that gives no status."""
    return 2, f"{_VERDICTS[2]}: {why}"


def duration(seconds: float) -> str:
    """Return a length of time for people, in its two largest units."""
    total = max(0, round(seconds))
    if total < 60:
        return f"{total} s"
    if total < 3600:
        return f"{total // 60} min {total % 60} s"
    if total < 86400:
        return f"{total // 3600} h {total % 3600 // 60} min"
    return f"{total // 86400} d {total % 86400 // 3600} h"


def _doing(status: Status) -> str:
    source = status.source
    if status.state is State.TRACKING:
        fps = "" if source.fps is None else f" at {source.fps:.1f} frames/s"
        touches = "1 touch" if status.cursors == 1 else f"{status.cursors} touches"
        return f"tracking{fps}, {touches}"
    if status.state in (None, State.NO_FRAMES):
        since_s = status.started_s if status.state is None else status.state_since_s
        why = source.waiting or status.why
        return f"no frames for {duration(status.time_s - since_s)}{_because(why)}"
    return f"{str(status.state).replace('-', ' ')}{_because(status.why)}"


def _because(why: str | None) -> str:
    return "" if why is None else f": {_one_line(why)}"


def _critical(status: Status) -> Iterator[str]:
    if status.state in (None, State.NO_FRAMES, State.NO_SURFACE):
        yield _doing(status)


def _warnings(status: Status) -> Iterator[str]:
    lasted_s = status.time_s - status.state_since_s
    if status.state is State.PAUSED:
        yield _doing(status)
    if status.state is State.CALIBRATING and lasted_s > _LONG_CALIBRATION_S:
        yield f"calibrating for {duration(lasted_s)}{_because(status.why)}"
    if status.config.problem is not None:
        yield "the config's last edit was refused, and the config from before it is in force"
    if status.not_kept is not None:
        yield _one_line(status.not_kept)
    for output in status.outputs:
        if output.troubled_lately:
            yield f"{output.name}: {_trouble(output)}{_because(output.last_error)}"
    yield from _source_warnings(status.source)
    if status.surface is not None:
        yield from status.surface.problems
    if status.area is not None and status.area.origin not in (AreaOrigin.GUESSED, AreaOrigin.WHOLE_PICTURE):
        yield from status.area.notes


def _source_warnings(source: SourceFacts) -> Iterator[str]:
    dropped = source.dropped_lately
    if source.fps is not None and dropped > _DROPPED_SHARE * (dropped + source.fps * 60.0):
        yield f"{dropped} frames were dropped in the last minute: this machine is too slow or too busy"
    if _loses_packets(source):
        yield f"{source.name}: {_packets_lost(source)}"


def _trouble(output: OutputFacts) -> str:
    return f"{output.troubled_lately} not sent in the last minute"


def _state_lines(status: Status) -> list[str]:
    lasted = duration(status.time_s - status.state_since_s)
    if status.state is None:
        return [f"! no frame yet, {lasted} after the start{_because(status.source.waiting)}"]
    bad = "! " if status.state in (State.NO_FRAMES, State.NO_SURFACE, State.PAUSED) else ""
    return [f"{bad}{str(status.state).replace('-', ' ')} for {lasted}{_because(status.why)}"]


def _source_lines(source: SourceFacts) -> list[str]:
    fps = "no frames now" if source.fps is None else f"{source.fps:.1f} frames/s"
    counts = [fps, f"{_grouped(source.frames)} frames", f"{_grouped(source.dropped)} dropped"]
    if source.reconnects:
        counts.append(f"connected anew {_times(source.reconnects)}")
    lines = [f"{source.kind}: {source.name}", ", ".join(counts)]
    if None not in (source.latency_p50_ms, source.latency_p99_ms, source.latency_max_ms):
        lines.append(
            f"{source.latency_p50_ms:.1f} ms from frame to touch; 99 of 100 within {source.latency_p99_ms:.1f} ms, "
            f"all within {source.latency_max_ms:.1f} ms"
        )
    if source.packet_loss is not None and source.packet_loss > _SHOWN_PACKET_LOSS:
        lines.append(f"{'! ' if _loses_packets(source) else ''}{_packets_lost(source)}")
    if source.waiting is not None:
        lines.append(f"! {_one_line(source.waiting)}")
    return lines


def _loses_packets(source: SourceFacts) -> bool:
    """Return whether a source loses so many packets that something should be done about it."""
    return source.packet_loss is not None and source.packet_loss > PACKET_LOSS_WORTH_TELLING


def _packets_lost(source: SourceFacts) -> str:
    lost = f"{_figure(source.packet_loss, '.1%')} of its packets were lost in the last 10 s"
    return f"{lost}: {PACKET_LOSS_REMEDY}" if _loses_packets(source) else lost


def _surface_lines(surface: SurfaceFacts | None, now_s: float) -> list[str]:
    if surface is None:
        return ["none yet"]
    age = "" if surface.made_s is None else f" {duration(now_s - surface.made_s)} ago"
    return [
        f"learned{age} from {surface.made_from}",
        f"{_figure(surface.distance_mm, '.0f')} mm away, tilted {_figure(surface.tilt_deg, '.0f')}°, flat to "
        f"{_figure(surface.flatness_mm, '.1f')} mm, noise {_figure(surface.noise_mm, '.2f')} mm",
        f"{_figure(surface.coverage, '.1%')} of the area usable; touches are looked for "
        f"{_figure(surface.near_mm, '.1f')} to {_figure(surface.far_mm, '.1f')} mm above it",
        *_change_lines(surface),
        *(f"! {_one_line(problem)}" for problem in surface.problems),
    ]


def _change_lines(surface: SurfaceFacts) -> list[str]:
    """Return what became of a surface since it was learned; nothing where it stays as it was learned."""
    if surface.drift_mm is None:
        return []
    moves = f"; moved {_times(surface.moves)} and learned again" if surface.moves else ""
    return [f"drifted by {surface.drift_mm:.1f} mm since then, which is followed{moves}"]


def _area_lines(area: AreaFacts | None) -> list[str]:
    if area is None:
        return ["known once there is a surface"]
    size = "" if area.size_mm is None else f", {area.size_mm[0]:.0f} x {area.size_mm[1]:.0f} mm"
    residual = "" if area.residual_mm is None else f", residual {area.residual_mm:.1f} mm"
    eye = [] if area.eye_mm is None else [_eye_line(area.eye_mm)]
    return [f"{_ORIGINS[area.origin]}{size}{residual}", *eye, *(f"! {_one_line(note)}" for note in area.notes)]


def _eye_line(eye: EyeOffsets) -> str:
    return (
        f"told ahead along the finger: {eye.bottom:.1f} mm from the bottom, {eye.top:.1f} from the top, "
        f"{eye.left:.1f} from the left, {eye.right:.1f} from the right"
    )


def _output_lines(output: OutputFacts) -> list[str]:
    counts = [f"{_grouped(output.sent)} sent"]
    counts += [f"{_grouped(output.failed)} failed"] if output.failed else []
    counts += [f"{_grouped(output.dropped)} dropped"] if output.dropped else []
    lines = [f"{output.name}: {', '.join(counts)}"]
    if output.troubled_lately:
        lines.append(f"! {_trouble(output)}")
    several = [one for one in output.destinations if one.last_error is not None]
    if not several and output.last_error is not None:
        lines.append(f"  last error: {_one_line(output.last_error)}")
    return lines + [
        f"  {one.destination}: {_grouped(one.failed)} failed; last error: {_one_line(one.last_error or '')}"
        for one in several
    ]


def _config_lines(status: Status) -> list[str]:
    config = status.config
    lines = [config.path or "defaults: there is no config file"]
    if config.problem is not None:
        ago = "" if config.problem_since_s is None else f" {duration(status.time_s - config.problem_since_s)} ago"
        lines.append(f"! the last edit was refused{ago}; the config from before it is in force:")
        lines += [f"  {line}" for line in config.problem.splitlines()]
    return lines


def _process_lines(status: Status) -> list[str]:
    memory = "" if status.memory_bytes is None else f", {status.memory_bytes / 1e6:.0f} MB of memory"
    lines = [f"touchd {status.version}, pid {status.pid}, running for {duration(status.uptime_s)}{memory}"]
    return lines if status.not_kept is None else [*lines, f"! {_one_line(status.not_kept)}"]


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _figure(value: float | None, form: str) -> str:
    return "?" if value is None else format(value, form)


def _grouped(count: int) -> str:
    return f"{count:,}".replace(",", " ")


def _times(count: int) -> str:
    return {1: "once", 2: "twice"}.get(count, f"{count} times")
