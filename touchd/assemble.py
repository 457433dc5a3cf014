"""From a config to the parts that run: settings of the stages, sources, outputs."""

import hashlib
import os
import socket
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from ipaddress import IPv4Address
from pathlib import Path

from touchd.config.output_sections import Output as OutputSection
from touchd.config.output_sections import Tuio
from touchd.config.schema import Config
from touchd.errors import ConfigError, SourceError
from touchd.formats.recording import open_recording
from touchd.outputs.events import QueuedEventWriter
from touchd.outputs.output import Output
from touchd.outputs.tuio import TuioEncoder, default_source, first_fseq, session_offset
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender, parse_destination
from touchd.pipeline import MissingArea, PipelineSettings
from touchd.sources.recording import RecordingSource

_BUILT_SOURCES = ("recording",)


def pipeline_settings(config: Config, calibration_frames: int, missing_area: MissingArea) -> PipelineSettings:
    """Return the settings of all stages; ``calibration_frames`` may differ from the config's for short recordings."""
    return PipelineSettings(
        calibration=replace(config.calibration_settings(), frames=calibration_frames),
        shell=config.shell_settings(),
        blobs=config.blob_settings(),
        tracking=config.tracking_settings(),
        area=config.area_corners(),
        missing_area=missing_area,
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
    """A source, how many frames to calibrate on, and sentences about it for the user."""

    source: RecordingSource
    calibration_frames: int
    notes: tuple[str, ...]


def open_source(config: Config) -> OpenedSource:
    """Open what ``source`` names. Raises SourceError."""
    kind = config.source.kind
    if kind not in _BUILT_SOURCES:
        raise SourceError(
            f"source.kind: this version of touchd cannot read from {kind!r}, only from {', '.join(_BUILT_SOURCES)}; "
            "play a recording with source: {kind: recording, path: FOLDER}"
        )
    if config.source.path is None:
        raise ConfigError("source.path is missing: name the folder of the recording to play")
    recording = open_recording(config.source.path)
    frames, note = frames_to_calibrate(config, len(recording))
    source = RecordingSource(recording, config.intrinsics(recording.sensor.intrinsics))
    return OpenedSource(source, frames, recording.notes + ((note,) if note else ()))


def make_outputs(config: Config, instance: str, stored_fseq: int) -> list[Output]:
    """Return the outputs that the config asks for, not yet started. Raises OutputError."""
    return [_make_output(item, instance, stored_fseq) for item in config.outputs]


def _make_output(item: OutputSection, instance: str, stored_fseq: int) -> Output:
    if item.events is not None:
        return QueuedEventWriter(item.events.path)
    tuio = item.tuio or Tuio()
    now_s = time.time()
    source = tuio.source
    if source == "auto":
        source = default_source(socket.gethostname(), instance, address_towards(tuio.to))
    return TuioUdpOutput(TuioEncoder(source, session_offset(now_s), first_fseq(now_s, stored_fseq)), UdpSender(tuio.to))


def address_towards(destinations: Sequence[str]) -> str:
    """Return this host's own IPv4 address on the way to the first destination given by one; asks nobody."""
    for destination in map(parse_destination, destinations):
        with suppress(ValueError, OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            # Connecting a UDP socket sends nothing; it only picks a route.
            probe.connect((str(IPv4Address(destination.host)), destination.port))
            return str(probe.getsockname()[0])
    return "127.0.0.1"


def highest_fseq(outputs: Sequence[Output]) -> int:
    """Return the highest TUIO frame number sent so far by any output, 0 without one."""
    return max((output.last_fseq for output in outputs if isinstance(output, TuioUdpOutput)), default=0)


def instance_of(state_folder: Path) -> str:
    """Return a short name that tells this daemon from others on the same host: one daemon has one state folder."""
    return hashlib.sha256(os.fsencode(state_folder.absolute())).hexdigest()[:4]
