"""A computer in a folder: its /sys, /proc, /dev and /etc, with virtual Kinects on its USB."""

import errno
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from touchd.doctor.computer import Computer
from touchd.errors import SourceError
from touchd.sources.kinect.devices import UsbPresence, look_at_usb

from virtual_kinect.backend import ModelBackend
from virtual_kinect.bus import Bus, Kinect, KinectPlan
from virtual_kinect.faults import Faults
from virtual_kinect.model import Device, DeviceClock
from virtual_kinect.stream import PICTURE_BYTES, Film

NOW_S = 1_800_000_000.0
USER_ID = 1000
OWN_PID = 4242
INTEL = (0x8086, 0x1E31, "xhci_hcd")
RULE = "etc/udev/rules.d/60-touchd.rules"
SOURCE_CHECKOUT = Path(__file__).parents[1]
_UDP_HEAD = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
_UNIX_HEAD = "Num       RefCount Protocol Flags    Type St Inode Path\n"


class FakeComputer:
    """A computer of user 1000, who may use all that is not forbidden. All is well, but no Kinect is there unless
    ``kinects`` says so, and no udev rule.
    """

    def __init__(
        self,
        folder: Path,
        kinects: Sequence[KinectPlan] = (),
        controller: tuple[int | None, int | None, str] = INTEL,
        user: str = "ada",
    ) -> None:
        self._user = user
        self.root = folder / "root"
        self._home = folder / "home"
        clock = DeviceClock()
        film = Film((bytes(PICTURE_BYTES),))
        self._kinects = [Kinect(plan, film, clock) for plan in kinects]
        self._bus = Bus(self._kinects)
        self._look = lambda: look_at_usb(ModelBackend(self._bus, clock))
        self._forbidden: set[Path] = set()
        self._write_controller(*controller)
        for device in self._bus.devices[1:]:
            self.add(device)
        self._write_system()

    def computer(self) -> Computer:
        """Return what the doctor looks at."""
        env = {"HOME": str(self._home), "XDG_RUNTIME_DIR": str(self.root / "run/user/1000"), "USER": self._user}
        return Computer(
            env=env,
            root=self.root,
            look=self._look,
            may_use=lambda path: path not in self._forbidden and path.exists(),
            now_s=lambda: NOW_S,
            uid=USER_ID,
            pid=OWN_PID,
        )

    @property
    def state_folder(self) -> Path:
        """Where this user's touchd keeps its surface."""
        return self._home / ".local/state/touchd"

    def without_libusb(self) -> Computer:
        """Return the computer as it is where there is no libusb."""
        return replace(self.computer(), look=_find_no_libusb)

    def write(self, path: str, text: str) -> Path:
        """Write a file of the computer's; return where it is."""
        place = self.root / path.lstrip("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
        return place

    def add(self, device: Device) -> None:
        """Plug a device in, of which only sysfs tells."""
        shape = device.shape
        folder = self._sysfs(device)
        attributes = {
            "idVendor": f"{shape.vendor_id:04x}",
            "idProduct": f"{shape.product_id:04x}",
            "bcdDevice": f"{shape.device_release:04x}",
            "busnum": device.bus,
            "devnum": device.address,
            "speed": shape.speed_mbit,
            "power/control": "on",
            **({} if shape.serial is None else {"serial": shape.serial}),
        }
        for name, value in attributes.items():
            self.write(f"{folder}/{name}", f"{value}\n")
        self.write(self.node(device), "")
        links = self.root / "sys/bus/usb/devices"
        links.mkdir(parents=True, exist_ok=True)
        (links / device.name).symlink_to(Path("../../../../") / folder)

    def camera(self, kinect: int = 0) -> Device:
        """Return the camera of a Kinect."""
        camera = self._kinects[kinect].camera
        assert camera
        return camera

    @staticmethod
    def node(device: Device) -> str:
        """Return the file through which programs use a device."""
        return f"/dev/bus/usb/{device.bus:03d}/{device.address:03d}"

    def bind(self, device: Device, driver: str) -> None:
        """Let a driver of the kernel have a device's interface; "usbfs" is a program."""
        interface = self.root / self._sysfs(device) / f"{device.name}:1.0"
        interface.mkdir()
        (interface / "driver").symlink_to(f"../../../bus/usb/drivers/{driver}")

    def forbid(self, device: Device) -> None:
        """Let this user not use a device."""
        device.faults = Faults(open_errno=errno.EACCES)
        self._forbidden.add(self.root / self.node(device).lstrip("/"))

    def set_attribute(self, device: Device, name: str, value: str) -> None:
        self.write(f"{self._sysfs(device)}/{name}", value)

    def install_rule(self, group_id: int) -> None:
        """Install touchd's udev rule and its group."""
        self.write(RULE, (SOURCE_CHECKOUT / "systemd/60-touchd.rules").read_text())
        self.write("etc/group", f"root:x:0:\ntouchd:x:{group_id}:bob\n")

    def run_process(self, pid: int, command: str, *links: str) -> None:
        """Let a process run that has these open."""
        self.write(f"proc/{pid}/cmdline", "\0".join(command.split()) + "\0")
        self.write(f"proc/{pid}/comm", Path(command.split(maxsplit=1)[0]).name + "\n")
        (self.root / f"proc/{pid}/fd").mkdir()
        for number, link in enumerate(links):
            (self.root / f"proc/{pid}/fd/{number}").symlink_to(link)

    def listen(self, address: str, port: int, table: str = "udp") -> None:
        """Let somebody listen at an address, given in the hexadecimal digits of /proc/net/udp."""
        line = f"  1: {address}:{port:04X} 00000000:0000 07 00000000:00000000 00:00000000 00000000 1000 0 777\n"
        self.write(f"proc/net/{table}", _UDP_HEAD + line)

    def claim(self, destination: str, inode: int) -> None:
        """Let a touchd have claimed a destination."""
        line = f"0000000000000000: 00000002 00000000 00000000 0002 01 {inode} @touchd sends to {destination}\n"
        self.write("proc/net/unix", _UNIX_HEAD + line)

    def _sysfs(self, device: Device) -> str:
        names = [f"{device.bus}-" + ".".join(map(str, device.ports[: i + 1])) for i in range(len(device.ports))]
        return "/".join([self._controller, f"usb{device.bus}", *names])

    def _write_controller(self, vendor_id: int | None, device_id: int | None, driver: str) -> None:
        self._controller = "sys/devices/pci0000:00/0000:00:14.0"
        (self.root / self._controller).mkdir(parents=True)
        (self.root / self._controller / "driver").symlink_to(f"../../../bus/pci/drivers/{driver}")
        if vendor_id is not None:
            self.write(f"{self._controller}/vendor", f"{vendor_id:#06x}\n")
            self.write(f"{self._controller}/device", f"{device_id:#06x}\n")

    def _write_system(self) -> None:
        self.write("sys/module/usbcore/parameters/usbfs_memory_mb", "16\n")
        self.write("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "schedutil\n")
        self.write("proc/cpuinfo", "processor\t: 0\nmodel name\t: A\n\nprocessor\t: 1\nmodel name\t: A\n")
        self.write("proc/meminfo", "MemTotal:        8000000 kB\nMemFree: 1 kB\nMemAvailable:    4000000 kB\n")
        self.write("proc/net/unix", _UNIX_HEAD)
        self.write("etc/group", "root:x:0:\n")
        self.write("etc/passwd", "root:x:0:0:root:/root:/bin/sh\n")
        self.listen("0100007F" if sys.byteorder == "little" else "7F000001", 3333)


def _find_no_libusb() -> UsbPresence:
    raise SourceError("libusb is missing, which talks to the camera: apt-get install libusb-1.0-0")
