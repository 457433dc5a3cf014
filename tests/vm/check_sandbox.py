"""What the service may and may not do, tried from inside its sandbox. Run by `make test-vm`, as root."""

import re

import pytest

from vm.machine import Machine
from vm.unit import Unit

PROBE = "/usr/local/bin/probe"


def in_the_sandbox(machine: Machine, program: str) -> str:
    """Run a Python program as the service would run, and return what it printed."""
    unit = machine.run("cat", "/usr/local/lib/systemd/system/touchd.service")
    unit = re.sub(r"(?m)^(Type|ExecStart|ExecStopPost|ExecReload|WatchdogSec|Restart|WantedBy)=.*\n", "", unit)
    unit = unit.replace("[Service]", f"[Service]\nType=oneshot\nExecStart=/opt/touchd/venv/bin/python {PROBE}")
    machine.write("/run/systemd/system/touchd-probe.service", unit.partition("[Install]")[0])
    machine.write(PROBE, program)
    probe = Unit(machine, "touchd-probe.service")
    machine.run("systemctl", "daemon-reload")
    probe.forget()
    probe.ctl("start", check=False)
    lines = probe.journal()
    machine.shell(f"rm {PROBE} /run/systemd/system/touchd-probe.service; systemctl daemon-reload")
    assert probe.show("Result") == "success", lines
    return "\n".join(lines)


@pytest.mark.usefixtures("touchd")
def test_the_sandbox_has_usb_and_no_other_device(machine: Machine) -> None:
    # No computer's USB is here: 189 is its number in Linux's device list, 188 that of USB serial ports. A node that
    # may be opened has no driver (ENXIO, ENODEV); one that may not is EPERM.
    machine.shell(
        "mkdir -p /dev/bus/usb/009; mknod /dev/bus/usb/009/001 c 189 1024; mknod /dev/other c 188 0;"
        "chown root:touchd /dev/bus/usb/009/001 /dev/other; chmod 660 /dev/bus/usb/009/001 /dev/other;"
        "grep -q usb_device /proc/devices ||"
        " { sed '/^Char/a 189 usb_device' /proc/devices >/run/devices; mount --bind /run/devices /proc/devices; }"
    )
    said = in_the_sandbox(
        machine,
        """
import errno, os
for path in ("/dev/bus/usb/009/001", "/dev/other", "/dev/null"):
    try:
        os.close(os.open(path, os.O_RDWR))
        print(path, "opened")
    except OSError as error:
        print(path, errno.errorcode[error.errno])
""",
    )
    assert re.search(r"/dev/bus/usb/009/001 (ENXIO|ENODEV)", said), said
    assert "/dev/other EPERM" in said
    assert "/dev/null opened" in said


@pytest.mark.usefixtures("touchd")
def test_the_sandbox_lets_the_usb_library_work(machine: Machine) -> None:
    # What libusb by way of ctypes needs: callbacks from C, although no memory may be written and executed, and
    # netlink, by which the kernel tells of cameras that come and go.
    said = in_the_sandbox(
        machine,
        """
import ctypes, socket
order = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(ctypes.c_int), ctypes.POINTER(ctypes.c_int))
numbers = (ctypes.c_int * 3)(3, 1, 2)
ctypes.CDLL(None).qsort(numbers, 3, 4, order(lambda a, b: a[0] - b[0]))
print("sorted", list(numbers))
with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 15) as events:
    events.bind((0, 1))
    print("netlink bound")
""",
    )
    assert "sorted [1, 2, 3]" in said
    assert "netlink bound" in said


@pytest.mark.usefixtures("touchd")
def test_the_sandbox_has_shared_memory_and_children_for_the_synthetic_table(machine: Machine) -> None:
    said = in_the_sandbox(
        machine,
        """
import multiprocessing
from multiprocessing.shared_memory import SharedMemory

def fill(name):
    memory = SharedMemory(name)
    memory.buf[0] = 7
    memory.close()

if __name__ == "__main__":
    memory = SharedMemory(create=True, size=640 * 480 * 2)
    child = multiprocessing.get_context("spawn").Process(target=fill, args=(memory.name,))
    child.start()
    child.join()
    print("the child wrote", memory.buf[0])
    memory.close()
    memory.unlink()
""",
    )
    assert "the child wrote 7" in said


@pytest.mark.usefixtures("touchd")
def test_the_sandbox_is_closed(machine: Machine) -> None:
    said = in_the_sandbox(
        machine,
        """
import ctypes, mmap, os, socket

def refused(what, job):
    try:
        job()
        print(what, "allowed")
    except OSError as error:
        print(what, "refused")

def mounted_to_write(folder):
    if os.statvfs(folder).f_flag & os.ST_RDONLY:
        raise OSError

def make_namespace():
    if ctypes.CDLL(None).unshare(0x10000000) != 0:
        raise OSError

refused("config", lambda: mounted_to_write("/etc/touchd"))
refused("program", lambda: mounted_to_write("/opt/touchd/venv"))
refused("system", lambda: mounted_to_write("/usr/lib"))
refused("homes", lambda: open("/root/secret"))
refused("raw", lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW))
refused("code", lambda: mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC))
refused("namespaces", make_namespace)
refused("others", lambda: os.stat("/proc/1"))
""",
    )
    found = dict(re.findall(r"(?m)^(\w+) (refused|allowed)$", said))
    assert len(found) == 8, said
    assert set(found.values()) == {"refused"}, said
