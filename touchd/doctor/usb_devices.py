"""The USB devices that the kernel knows, from sysfs: this needs neither libusb nor any permission.

What the files mean: the kernel's Documentation/ABI/testing/sysfs-bus-usb.
"""

import re
from dataclasses import dataclass
from pathlib import Path

from touchd.doctor.computer import Computer, as_number, link_name, names_in, read_text

_FOLDER = "/sys/bus/usb/devices"
_DEVICE_NAME = re.compile(r"\d+-\d+(\.\d+)*")
_ROOT_HUB_NAME = re.compile(r"usb\d+")


@dataclass(frozen=True, slots=True)
class UsbDevice:
    """A USB device; what sysfs does not tell is None."""

    name: str  # the kernel's, by where it is plugged in: 1-1.4
    folder: Path  # in sysfs
    vendor_id: int
    product_id: int
    release: int
    bus: int
    address: int
    serial: str | None
    speed_mbit: int | None
    power_control: str | None  # "auto" where it may be suspended while nobody uses it, else "on"
    drivers: tuple[str, ...]  # of its interfaces; "usbfs" is a program

    @property
    def place(self) -> str:
        """Where it is plugged in, as touchd writes it."""
        return f"usb:{self.name}"

    @property
    def node(self) -> str:
        """The file through which programs use it."""
        return f"/dev/bus/usb/{self.bus:03d}/{self.address:03d}"

    @property
    def parent(self) -> str:
        """The name of the hub that it hangs on; the bus for a root hub."""
        head, dot, _ = self.name.rpartition(".")
        return head if dot else self.name.partition("-")[0]

    @property
    def hubs_between(self) -> int:
        """How many hubs are between it and the computer."""
        return self.name.count(".")


@dataclass(frozen=True, slots=True)
class Controller:
    """A USB host controller; the ids are those of PCI, None for one that is not on PCI."""

    place: str
    driver: str | None
    vendor_id: int | None
    device_id: int | None


def usb_devices(computer: Computer) -> tuple[UsbDevice, ...]:
    """Return all devices but root hubs, in the order of where they are plugged in."""
    folder = computer.at(_FOLDER)
    found = [_device(name, folder / name) for name in names_in(folder) if _DEVICE_NAME.fullmatch(name)]
    return tuple(sorted(filter(None, found), key=lambda device: [int(n) for n in re.findall(r"\d+", device.name)]))


def controller_of(device: UsbDevice) -> Controller | None:
    """Return what drives the bus of a device; None if sysfs does not tell."""
    for folder in device.folder.resolve().parents:
        if _ROOT_HUB_NAME.fullmatch(folder.name):
            above = folder.parent
            return Controller(
                above.name,
                link_name(above / "driver"),
                as_number(read_text(above / "vendor"), 16),
                as_number(read_text(above / "device"), 16),
            )
    return None


def _device(name: str, folder: Path) -> UsbDevice | None:
    ids = [as_number(read_text(folder / key), 16) for key in ("idVendor", "idProduct", "bcdDevice")]
    place = [as_number(read_text(folder / key)) for key in ("busnum", "devnum")]
    vendor_id, product_id, release = ids
    bus, address = place
    if vendor_id is None or product_id is None or bus is None or address is None:
        return None  # it went away in this very moment
    return UsbDevice(
        name=name,
        folder=folder,
        vendor_id=vendor_id,
        product_id=product_id,
        release=release or 0,
        bus=bus,
        address=address,
        serial=read_text(folder / "serial") or None,
        speed_mbit=as_number((read_text(folder / "speed") or "").partition(".")[0]),
        power_control=read_text(folder / "power" / "control"),
        drivers=_drivers(name, folder),
    )


def _drivers(name: str, folder: Path) -> tuple[str, ...]:
    interfaces = [entry for entry in names_in(folder) if entry.startswith(f"{name}:")]
    return tuple(sorted({driver for each in interfaces if (driver := link_name(folder / each / "driver")) is not None}))
