"""What ``touchd list`` says: the depth cameras that are plugged in."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from touchd.doctor.computer import Computer
from touchd.doctor.depth_cameras import PluggedKinect
from touchd.doctor.survey import Survey, survey
from touchd.doctor.use import CameraUse, Use, use_of
from touchd.errors import ExitCode, SourceError
from touchd.sources.kinect.devices import choose

_NONE = "no depth camera is plugged in: connect a Kinect's USB cable and its power supply"


@dataclass(frozen=True, slots=True)
class ListedCamera:
    """A depth camera as it is told of. ``chosen``: touchd would use it now."""

    place: str  # usb:1-1.4, for source.serial
    serial: str | None
    model: str
    use: Use
    detail: str
    chosen: bool


@dataclass(frozen=True, slots=True)
class Listing:
    """All cameras, and sentences about what stands in the way of choosing one."""

    cameras: tuple[ListedCamera, ...]
    notes: tuple[str, ...]

    @property
    def exit_code(self) -> ExitCode:
        """0 if there is a camera that touchd can read, though perhaps not for this user."""
        readable = any(camera.use not in {Use.NO_CAMERA, Use.UNSUPPORTED} for camera in self.cameras)
        return ExitCode.OK if readable else ExitCode.UNAVAILABLE


def list_cameras(computer: Computer, config: Path | None, socket: Path | None) -> Listing:
    """Look at the bus and list what is there."""
    return listing_of(computer, survey(computer, config, socket))


def listing_of(computer: Computer, found: Survey) -> Listing:
    """Return the cameras of a survey."""
    chosen, why_not = chosen_place(found)
    kinects = (_listed(kinect, use_of(computer, found, kinect), chosen) for kinect in found.plugged.kinects)
    cameras = (*kinects, *_not_of_use(found))
    notes = (*filter(None, (found.no_libusb, why_not)), *(() if cameras else (_NONE,)))
    if found.config_problem is not None:
        notes = (*notes, "the config cannot be read, so source.serial is not known; see touchd check-config")
    return Listing(tuple(cameras), notes)


def chosen_place(found: Survey) -> tuple[str | None, str | None]:
    """Return where the Kinect is that touchd would use, or why it would use none of those that are there."""
    if not found.plugged.kinects or found.presence is None:
        return None, None
    if not found.wants_kinect:
        return None, f"the config's source is {found.config.source.kind}, so touchd would use no camera"
    remembered = None if found.surface is None else found.surface.camera
    try:
        return choose(found.presence, found.config.source.serial, remembered).path, None
    except SourceError as error:
        return None, str(error)


def listing_lines(listing: Listing) -> list[str]:
    """Return one line for each camera, with a star before the one that touchd would use, and the notes."""
    rows = [
        ("*" if camera.chosen else " ", camera.place, camera.serial or "-", camera.model, camera.detail)
        for camera in listing.cameras
    ]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)] if rows else []
    lines = ["  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [*lines, *_legend(listing.cameras), *listing.notes]


def listing_json(listing: Listing) -> str:
    """Return the listing as JSON. Keys may be added, never renamed."""
    cameras = [asdict(camera) for camera in listing.cameras]
    return json.dumps({"cameras": cameras, "notes": listing.notes}, indent=2)


def use_in_words(use: CameraUse, node: str) -> str:
    """Return how a camera fares, in a few words."""
    return {
        Use.FREE: "ready",
        Use.KERNEL_DRIVER: "ready: touchd takes it from the kernel's driver gspca_kinect",
        Use.TOUCHD: f"in use by {', '.join(map(str, use.by)) or 'the running touchd'}",
        Use.HELD: f"held by {use.who}",
        Use.DENIED: f"no permission to use {node}: see touchd doctor",
    }[use.use]


def _listed(kinect: PluggedKinect, use: CameraUse, chosen: str | None) -> ListedCamera:
    place = kinect.camera.place
    return ListedCamera(
        place, kinect.serial, kinect.model, use.use, use_in_words(use, kinect.camera.node), place == chosen
    )


def _not_of_use(found: Survey) -> Iterator[ListedCamera]:
    for device, part in found.plugged.without_camera:
        detail = f"only its {part.value} is there: connect the Kinect's power supply"
        yield ListedCamera(device.place, None, "Kinect without its camera", Use.NO_CAMERA, detail, chosen=False)
    for device, name in found.plugged.others:
        detail = "not supported yet by this version of touchd"
        yield ListedCamera(device.place, device.serial, name, Use.UNSUPPORTED, detail, chosen=False)


def _legend(cameras: Sequence[ListedCamera]) -> list[str]:
    return ["* the one that touchd would use"] if any(camera.chosen for camera in cameras) else []
