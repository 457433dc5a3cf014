"""Findings about touchd itself: its config, its stored surface, the running daemon."""

from collections.abc import Iterator

from touchd.control.errors import NotRunning
from touchd.doctor.computer import Computer
from touchd.doctor.finding import Finding, Level
from touchd.doctor.survey import StoredSurface, Survey
from touchd.errors import ExitCode
from touchd.status.text import check, duration

_LEVELS = (Level.OK, Level.NOTE, Level.PROBLEM)  # by the verdict of touchd status --check
_NEW_SURFACE = (
    "touchd calibrate, with nothing and nobody above the surface; without a running daemon touchd run does it"
)


def config(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say which config is in force, and whether it is right."""
    del computer
    where = "the defaults: there is no config file" if found.config_path is None else str(found.config_path)
    if found.config_problem is not None:
        first = found.config_problem.splitlines()[0]
        yield Finding("config", Level.PROBLEM, first, "touchd check-config says all that is wrong", ExitCode.BAD_CONFIG)
    elif found.config.source.kind == "realsense":
        text = f"{where}: source.kind is realsense, which this version of touchd cannot read from"
        yield Finding("config", Level.PROBLEM, text, "use kinect, recording or synthetic")
    else:
        source = found.config.source
        wanted = "" if source.serial is None else f" {source.serial}"
        yield Finding("config", Level.OK, f"{where}; source: {source.kind}{wanted}")


def daemon(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether a touchd runs, and how it fares."""
    del computer
    if found.status is not None:
        code, text = check(found.status)
        remedy = None if code == 0 else "touchd status says more"
        yield Finding("daemon", _LEVELS[code], f"touchd runs (pid {found.status.pid}); {text}", remedy)
    elif isinstance(found.no_status, NotRunning):
        yield Finding("daemon", Level.OK, str(found.no_status))
    else:
        yield Finding("daemon", Level.NOTE, str(found.no_status))


def surface(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say of which camera the stored surface is, and how old."""
    stored = found.surface
    if stored is None:
        where = "" if computer.uid == 0 else " that you may see"
        yield Finding("surface", Level.OK, f"there is no stored surface{where}: touchd run learns one at its start")
        return
    age = duration(computer.now_s() - stored.made_s)
    text = f"{stored.path}: learned {age} ago with {stored.camera or 'a camera without a name'}"
    misfit = _misfit(found, stored)
    if misfit is None:
        yield Finding("surface", Level.OK, text)
    else:
        yield Finding("surface", Level.NOTE, f"{text}; {misfit}", _NEW_SURFACE)


def _misfit(found: Survey, stored: StoredSurface) -> str | None:
    """Return why a stored surface will not be used, as far as can be told without opening the camera."""
    if not found.wants_kinect or found.presence is None or not found.presence.kinects:
        return None
    if stored.camera is None:
        return "its file does not tell the camera, so touchd learns another one at its start"
    if any(kinect.answers_to(stored.camera) for kinect in found.presence.kinects):
        return None
    there = ", ".join(kinect.identity for kinect in found.presence.kinects)
    return f"plugged in is {there}, so touchd learns another one at its start"
