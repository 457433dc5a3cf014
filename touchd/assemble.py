"""From a config to the parts that run: settings of the stages, sources, outputs."""

import socket
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial, reduce
from ipaddress import IPv4Address

from touchd.config.output_sections import Events as EventsSection
from touchd.config.output_sections import Output as OutputSection
from touchd.config.output_sections import Tuio as TuioSection
from touchd.config.schema import Config
from touchd.errors import ConfigError, SourceError
from touchd.formats.recording import open_recording
from touchd.geometry import kinect_v1_sensor
from touchd.model import AreaCorners
from touchd.outputs.events import QueuedEventWriter
from touchd.outputs.output import Output
from touchd.outputs.profiles import CURSOR_25D, PROFILES
from touchd.outputs.tuio import TuioEncoder, default_source, first_fseq, later_fseq, session_offset
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender, open_udp_socket, open_udp_socket_on, parse_destination
from touchd.ready import MissingArea, PipelineSettings
from touchd.sources.kinect.camera import CameraSettings
from touchd.sources.kinect.source import KinectSource
from touchd.sources.recording import RecordingSource
from touchd.sources.source import Source
from touchd.sources.synthetic import SyntheticSource

_BUILT_SOURCES = ("kinect", "recording", "synthetic")
# The synthetic table stays empty for a second longer than it takes to learn it.
_SPARE_FRAMES = 30
# More than an output sends between the making of the one that replaces it and that one's start.
_FSEQ_MARGIN = 1000


def pipeline_settings(config: Config, calibration_frames: int, missing_area: MissingArea) -> PipelineSettings:
    """Return the settings of all stages; ``calibration_frames`` may differ from the config's for short recordings."""
    return PipelineSettings(
        calibration=replace(config.calibration_settings(), frames=calibration_frames),
        living=config.living_settings(),
        method=config.touch.method,
        shell=config.shell_settings(),
        blobs=config.blob_settings(),
        tracking=config.tracking_settings(),
        objects=config.object_settings(),
        area=config.area_corners(),
        missing_area=missing_area,
        eye=config.eye_offsets(),
    )


def frames_to_calibrate(config: Config, available: int) -> tuple[int, str | None]:
    """Return on how many first frames of a recording to calibrate, and a sentence if that is not the config's number.

    A recording with fewer than three times as many frames gives its first third, unless the user set the number.
    """
    wanted = config.calibration.frames
    if config.was_set("calibration.frames") or available >= 3 * wanted:
        return wanted, None
    frames = max(1, available // 3)
    return frames, (
        f"the recording has only {available} depth frames, so the surface is learned from its first {frames} "
        f"(calibration.frames is {wanted} where it is not set)"
    )


@dataclass(frozen=True, slots=True)
class OpenedSource:
    """A source, and what is known of the place that it looks at."""

    source: Source
    calibration_frames: int
    area: AreaCorners | None  # where the source itself knows it
    notes: tuple[str, ...]  # sentences for the user


def open_source(config: Config, remembered_camera: str | None = None) -> OpenedSource:
    """Open what ``source`` names. Raises SourceError, and ConfigError where keys that it needs are missing.

    ``remembered_camera``: the one to prefer where the config names none and several are plugged in.
    """
    kind = config.source.kind
    if kind == "kinect":
        return _open_kinect(config, remembered_camera)
    if kind == "recording":
        return _open_recording(config)
    if kind == "synthetic":
        return _open_synthetic(config)
    raise SourceError(
        f"source.kind: this version of touchd cannot read from {kind!r}, only from {', '.join(_BUILT_SOURCES)}; "
        "see hands without a camera with source: {kind: synthetic}"
    )


def _open_kinect(config: Config, remembered_camera: str | None) -> OpenedSource:
    source = KinectSource(
        config.source.serial,
        remembered_camera,
        CameraSettings(config.source.ir_brightness, config.source.near_mode),
        config.intrinsics(kinect_v1_sensor().intrinsics),
    )
    return OpenedSource(source, config.calibration.frames, None, ())


def _open_recording(config: Config) -> OpenedSource:
    if config.source.path is None:
        raise ConfigError("source.path is missing: name the folder of the recording to play")
    recording = open_recording(config.source.path)
    frames, note = frames_to_calibrate(config, len(recording))
    source = RecordingSource(recording, config.intrinsics(recording.sensor.intrinsics))
    return OpenedSource(source, frames, None, recording.notes + ((note,) if note else ()))


def _open_synthetic(config: Config) -> OpenedSource:
    if config.was_set("camera"):
        raise ConfigError("camera: the synthetic table's camera is known; remove the section, or play something else")
    frames = config.calibration.frames
    source = SyntheticSource(config.source.scenario, config.source.seed, empty_frames=frames + _SPARE_FRAMES)
    return OpenedSource(source, frames, source.area, ())


class OutputMaker:
    """Makes the outputs that configs ask for, and keeps those that a new config asks for again.

    Each destination is an output of its own, so that a change of one leaves the others' touches alone. All of a run
    share one offset of session ids, but for a destination that gets a second output: there the ids must not come back.
    """

    def __init__(self, instance: str, stored_fseq: int) -> None:
        """``instance``: tells this daemon from others on the host; ``stored_fseq``: the frame number to go on after."""
        self._instance = instance
        self._fseq = stored_fseq
        self._offset = session_offset(time.time())
        self._made: dict[_Key, Output] = {}
        self._served: set[str] = set()  # TUIO destinations that have had an output

    def outputs(self, config: Config) -> list[Output]:
        """Return the outputs that a config asks for, the new ones not yet started.

        Raises ConfigError if two of them are the same, OutputError if one cannot be made.
        """
        keys = [key for item in config.outputs for key in _keys(item, config.tracking.hover_mm)]
        for index, key in enumerate(keys):
            if any(key[:2] == other[:2] for other in keys[:index]):
                raise ConfigError(f"outputs: {key[1]} is named twice; name each destination once")
        self._fseq = later_fseq(self._fseq, latest_fseq(list(self._made.values())))
        self._made = {key: self._made.get(key) or self._make(key) for key in keys}
        return list(self._made.values())

    def _make(self, key: "_Key") -> Output:
        _, where, section, hover_mm = key
        if isinstance(section, EventsSection):
            return QueuedEventWriter(section.path)
        now_s = time.time()
        encoder = TuioEncoder(
            tuio_source(section.source, self._instance, where),
            session_offset(now_s) if where in self._served else self._offset,
            first_fseq(now_s, self._fseq and self._fseq + _FSEQ_MARGIN),
            PROFILES[section.profile],
        )
        self._served.add(where)
        interface = section.interface
        open_socket = open_udp_socket if interface is None else partial(open_udp_socket_on, interface)
        return TuioUdpOutput(encoder, UdpSender([where], open_socket=open_socket), section.view(hover_mm))


# What tells an output from others: kind and where to, which no two may share, and all that it is made from.
_Key = tuple[str, str, EventsSection | TuioSection, float]


def _keys(item: OutputSection, hover_mm: float) -> Iterator[_Key]:
    if item.events is not None:
        yield "events", str(item.events.path), item.events, 0.0
    elif item.tuio is not None:
        height_mm = hover_mm if item.tuio.profile == CURSOR_25D.name else 0.0  # nothing else is made from it
        for destination in item.tuio.to:
            yield "tuio", destination, item.tuio.model_copy(update={"to": (destination,)}), height_mm


def tuio_source(configured: str, instance: str, destination: str) -> str:
    """Return the name that a destination is sent to under; ``configured`` is the config's, "auto" for a made one."""
    if configured != "auto":
        return configured
    return default_source(socket.gethostname(), instance, address_towards([destination]))


def address_towards(destinations: Sequence[str]) -> str:
    """Return this host's own IPv4 address on the way to the first destination given by one; asks nobody."""
    for destination in map(parse_destination, destinations):
        with suppress(ValueError, OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            # Connecting a UDP socket sends nothing; it only picks a route.
            probe.connect((str(IPv4Address(destination.host)), destination.port))
            return str(probe.getsockname()[0])
    return "127.0.0.1"


def latest_fseq(outputs: Sequence[Output]) -> int:
    """Return the latest TUIO frame number sent so far by any output, 0 without one."""
    return reduce(later_fseq, (output.last_fseq for output in outputs if isinstance(output, TuioUdpOutput)), 0)
