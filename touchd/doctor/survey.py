"""Everything that the findings are made from, gathered once."""

from dataclasses import dataclass
from pathlib import Path

from touchd.config.load import find_config_path, load_config
from touchd.config.schema import Config
from touchd.control.client import fetch_status
from touchd.control.errors import NotRunning
from touchd.control.paths import find_control_socket
from touchd.doctor.computer import Computer
from touchd.doctor.depth_cameras import Plugged, sort_out
from touchd.doctor.open_files import OpenFiles, look_at_processes
from touchd.doctor.usb_devices import usb_devices
from touchd.errors import ConfigError, SourceError, TouchdError
from touchd.sources.kinect.devices import UsbPresence
from touchd.state import SURFACE_FILE, camera_of_surface, state_folder
from touchd.status.data import Status

_SERVICE_STATE = "/var/lib/touchd"  # systemd/touchd.service


@dataclass(frozen=True, slots=True)
class StoredSurface:
    """A stored surface's file; what cannot be read is None."""

    path: Path
    made_s: float  # Unix time
    camera: str | None


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found on a computer. Where there is a reason, there is not the thing itself."""

    plugged: Plugged
    presence: UsbPresence | None  # as the driver sees it
    no_libusb: str | None
    config_path: Path | None  # None: the defaults are in force
    config: Config  # the defaults, where there is a problem
    config_problem: str | None
    status: Status | None  # of the running daemon
    no_status: TouchdError | None
    surface: StoredSurface | None
    open_files: OpenFiles

    @property
    def wants_kinect(self) -> bool:
        """Whether the config's source is a Kinect."""
        return self.config.source.kind == "kinect"

    @property
    def runs(self) -> bool:
        """Whether a touchd runs, as far as can be told."""
        return self.status is not None or not isinstance(self.no_status, NotRunning)


def survey(computer: Computer, config: Path | None, socket: Path | None) -> Survey:
    """Look at everything once. ``config`` and ``socket`` are what the command line names."""
    presence, no_libusb = _presence(computer)
    config_path, in_force, config_problem = _config(computer, config)
    status, no_status = _status(computer, socket)
    return Survey(
        plugged=sort_out(usb_devices(computer)),
        presence=presence,
        no_libusb=no_libusb,
        config_path=config_path,
        config=in_force,
        config_problem=config_problem,
        status=status,
        no_status=no_status,
        surface=_surface(computer),
        open_files=look_at_processes(computer),
    )


def _presence(computer: Computer) -> tuple[UsbPresence | None, str | None]:
    try:
        return computer.look(), None
    except SourceError as error:
        return None, str(error)


def _config(computer: Computer, given: Path | None) -> tuple[Path | None, Config, str | None]:
    path = given
    try:
        path = find_config_path(given, computer.env, computer.uid)
        return path, load_config(path), None
    except ConfigError as error:
        return path, Config(), str(error)


def _status(computer: Computer, socket: Path | None) -> tuple[Status | None, TouchdError | None]:
    try:
        return fetch_status(find_control_socket(computer.env, socket, computer.at("/run"))), None
    except TouchdError as error:
        return None, error


def _surface(computer: Computer) -> StoredSurface | None:
    """Return the surface that this user's touchd has stored, else the service's."""
    for folder in (state_folder(computer.env), computer.at(_SERVICE_STATE)):
        path = folder / SURFACE_FILE
        try:
            made_s = path.stat().st_mtime
        except OSError:
            continue
        return StoredSurface(path, made_s, camera_of_surface(path))
    return None
