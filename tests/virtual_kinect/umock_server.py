"""Virtual Kinects under umockdev, as a process of its own. Run by Debian's Python, which has gi but no numpy.

Commands come as lines of JSON on standard input and each is answered with one on standard output: see umock.py.
"""

import errno
import json
import mmap
import os
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import gi  # type: ignore[import-not-found]

gi.require_version("UMockdev", "1.0")

from gi.repository import GLib, UMockdev  # type: ignore[import-not-found]  # noqa: E402

from virtual_kinect.bus import Bus, Kinect, KinectPlan, Model, Part  # noqa: E402
from virtual_kinect.camera import Constants  # noqa: E402
from virtual_kinect.faults import Faults  # noqa: E402
from virtual_kinect.model import Device  # noqa: E402
from virtual_kinect.stream import MICROFRAMES_PER_S, PICTURE_BYTES, Film  # noqa: E402
from virtual_kinect.umock_ioctls import DeviceNode, Setting  # noqa: E402

_USB_MAJOR = 189


class HostClock:
    """USB's time as it passes on this computer."""

    def microframe(self) -> int:
        return time.monotonic_ns() * MICROFRAMES_PER_S // 1_000_000_000


class PictureFile:
    """The pictures of a file that ``pictures.write_pictures`` wrote."""

    def __init__(self, path: Path) -> None:
        with path.open("rb") as file:
            self._map = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)

    def __len__(self) -> int:
        return len(self._map) // PICTURE_BYTES

    def __getitem__(self, index: int) -> bytes:
        return self._map[index * PICTURE_BYTES : (index + 1) * PICTURE_BYTES]


class Mock:
    """The bus, and the same devices in umockdev's test bed. Devices are added and removed in the main thread alone."""

    def __init__(self, order: dict[str, Any]) -> None:
        self._lock = threading.Lock()
        clock = HostClock()
        self._setting = Setting(clock, self._lock, order["patient"], self._remove_soon, self._streaming)
        self._testbed = UMockdev.Testbed.new()
        self._nodes: dict[Device, DeviceNode] = {}
        self._shown: list[Kinect] = []
        film = Film(PictureFile(Path(order["pictures"])), order["order"])
        self._kinects = [Kinect(_plan(plan), film, clock) for plan in order["kinects"]]
        self._bus = Bus()
        self._add(self._bus.root)
        for index in order["plugged"]:
            self._plug(index)

    @property
    def folder(self) -> str:
        return str(self._testbed.get_root_dir())

    def obey(self, command: dict[str, Any]) -> dict[str, Any]:
        """Do one command and return the answer."""
        index = command.get("kinect", 0)
        kinect = self._kinects[index]
        match command["do"]:
            case "plug":
                self._plug(index)
            case "unplug":
                with self._lock:
                    self._bus.unplug(kinect)
                self.remove_unplugged()
            case "faults":
                device = kinect.device(Part(command["part"]))
                with self._lock:
                    device.faults = Faults.from_json(command["faults"])
                self._set_permission(device)
            case "state":
                with self._lock:
                    return self._state(kinect)
            case other:
                raise ValueError(f"There is no command {other!r}")
        return {}

    def _plug(self, index: int) -> None:
        with self._lock:
            self._bus.plug(self._kinects[index])
        self._shown.append(self._kinects[index])
        for device in self._kinects[index].devices:
            self._add(device)
            self._set_permission(device)

    def remove_unplugged(self) -> None:
        """Take what has been unplugged, by command or by a fault, out of the test bed, children first."""
        gone = [kinect for kinect in self._shown if kinect not in self._bus.kinects]
        for kinect in gone:
            self._shown.remove(kinect)
            for device in reversed(kinect.devices):
                path = self._syspath(device)
                self._testbed.uevent(path, "remove")
                self._testbed.detach_ioctl(_node(device))
                self._testbed.remove_device(path)

    def _streaming(self) -> bool:
        return any(node.in_flight for node in self._nodes.values())

    def _add(self, device: Device) -> None:
        # First what answers, then the device, as the client is told of it at once.
        self._nodes[device] = DeviceNode(device, self._setting)
        self._testbed.attach_ioctl(_node(device), self._nodes[device].handler)
        self._testbed.add_from_string(_description(device, self._syspath(device)))

    def _remove_soon(self) -> None:
        # Before any command that comes later, so that whoever is told of it finds nothing.
        GLib.idle_add(self.remove_unplugged, priority=GLib.PRIORITY_HIGH)

    def _syspath(self, device: Device) -> str:
        names = [f"{device.bus}-" + ".".join(map(str, device.ports[: i + 1])) for i in range(len(device.ports))]
        return "/sys/devices/pci0000:00/0000:00:14.0/" + "/".join([f"usb{device.bus}", *names])

    def _set_permission(self, device: Device) -> None:
        """Let the node itself forbid to be opened, as it is opened without us."""
        forbidden = device.faults.open_errno == errno.EACCES
        if device.plugged:
            Path(self.folder + _node(device)).chmod(0 if forbidden else 0o666)

    def _state(self, kinect: Kinect) -> dict[str, Any]:
        camera, motor = kinect.camera, kinect.motor
        return {
            "plugged": kinect in self._bus.kinects,
            "addresses": {device.name: device.address for device in kinect.devices},
            "opens": {device.name: device.opens for device in kinect.devices},
            "claims": {device.name: device.claims for device in kinect.devices},
            "resets": {device.name: device.resets for device in kinect.devices},
            "owners": [device.name for device in kinect.devices if device.owner is not None],
            "registers": {} if camera is None else {str(key): value for key, value in camera.registers.items()},
            "in_flight": 0 if camera is None else self._nodes[camera].in_flight,
            "streaming": camera is not None and camera.stream is not None,
            "leds": [] if motor is None else motor.leds,
            "tilts": [] if motor is None else motor.tilts,
        }


def _plan(values: dict[str, Any]) -> KinectPlan:
    return KinectPlan(
        Model(values["model"]),
        values["serial"],
        tuple(values["ports"]),
        tuple(Part(part) for part in values["parts"]),
        Constants(**values["constants"]),
    )


def _node(device: Device) -> str:
    return f"/dev/bus/usb/{device.bus:03d}/{device.address:03d}"


def _description(device: Device, syspath: str) -> str:
    """Return a device as umockdev-record writes them: what udev and libusb read in sysfs."""
    shape = device.shape
    minor = (device.bus - 1) * 128 + device.address - 1
    attributes = {
        "busnum": device.bus,
        "devnum": device.address,
        "devpath": ".".join(map(str, device.ports)) or "0",
        "dev": f"{_USB_MAJOR}:{minor}",
        "speed": shape.speed_mbit,
        "idVendor": f"{shape.vendor_id:04x}",
        "idProduct": f"{shape.product_id:04x}",
        "bcdDevice": f"{shape.device_release:04x}",
        "bDeviceClass": f"{shape.device_class:02x}",
        "bConfigurationValue": 1,
        "bNumConfigurations": 1,
        "bNumInterfaces": " 1",
        "version": " 2.00",
        "manufacturer": "Microsoft",
        "product": shape.product,
    }
    if shape.serial is not None:
        attributes["serial"] = shape.serial
    properties = {
        "SUBSYSTEM": "usb",
        "DEVTYPE": "usb_device",
        "DEVNAME": _node(device),
        "BUSNUM": f"{device.bus:03d}",
        "DEVNUM": f"{device.address:03d}",
        "MAJOR": _USB_MAJOR,
        "MINOR": minor,
    }
    descriptors = shape.device_descriptor() + shape.configuration_descriptor()
    lines = [f"P: {syspath.removeprefix('/sys')}", f"N: {_node(device).removeprefix('/dev/')}"]
    lines += [f"E: {key}={value}" for key, value in properties.items()]
    lines += [f"A: {key}={value}\\n" for key, value in attributes.items()]
    return "\n".join([*lines, f"H: descriptors={descriptors.hex().upper()}", "", ""])


def _die(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    sys.__excepthook__(kind, error, trace)
    sys.stderr.flush()
    os._exit(70)


def main() -> None:
    """Serve until standard input ends. An exception ends the process, where gi would only print it and go on."""
    sys.excepthook = _die
    mock = Mock(json.loads(sys.stdin.readline()))
    loop = GLib.MainLoop()

    def answer(values: dict[str, Any]) -> None:
        os.write(sys.stdout.fileno(), json.dumps(values).encode() + b"\n")

    def read(*_: Any) -> bool:
        line = sys.stdin.readline()
        if not line:
            loop.quit()
            return False
        answer(mock.obey(json.loads(line)))
        return True

    GLib.io_add_watch(sys.stdin.fileno(), GLib.PRIORITY_DEFAULT, GLib.IO_IN | GLib.IO_HUP, read)
    answer({"folder": mock.folder})
    loop.run()


if __name__ == "__main__":
    main()
