"""The service for real: installed, run, hurt and removed in a Debian of its own. Run by `make test-vm`, as root.

The tests share one machine and run in order: the first ones find touchd freshly installed, the last one removes it.
"""

import re
from collections.abc import Iterator

import pytest

from clients.bundles import Bundle, Mailbox, read_bundle
from vm.machine import REPOSITORY, Machine, booted, wheels, why_not
from vm.unit import Unit, wait_until

WORST_EXPOSURE = 1.5
CONFIG = "/etc/touchd/touchd.yaml"
PROBE = "/usr/local/bin/probe"
# What comes and goes by itself, and what is this computer's.
PASSING = ("/proc", "/sys", "/dev", "/run", "/tmp", "/var/tmp", "/var/log", "/src", "/wheels")


class Hearing:
    """A TUIO client in the machine: keeps what it heard."""

    def __init__(self, box: Mailbox) -> None:
        self._box = box
        self.destination = box.destination
        self._heard: list[Bundle] = []

    def heard(self) -> list[Bundle]:
        self._heard += [read_bundle(datagram) for datagram in self._box.take()]
        return self._heard

    def forget(self) -> None:
        self.heard()
        self._heard = []

    def wait_for_a_touch(self) -> None:
        self.forget()
        wait_until(lambda: any(bundle.alive for bundle in self.heard()), lambda: f"{len(self.heard())} bundles")


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    if reason := why_not():
        pytest.fail(reason)
    console = tmp_path_factory.mktemp("machine") / "console"
    with console.open("wb") as log, booted(log, {REPOSITORY: "/src", wheels(): "/wheels"}) as machine:
        yield machine


def everything(machine: Machine) -> set[str]:
    """Return all files, users and groups, but those that pass."""
    passing = " -o ".join(f"-path {folder}" for folder in PASSING)
    files = machine.shell(f"find / \\( {passing} \\) -prune -o -print").splitlines()
    return {*files, *machine.shell("getent passwd; getent group").splitlines()}


@pytest.fixture(scope="module")
def bare(machine: Machine) -> set[str]:
    """What was there before the installation: a Debian with two people."""
    machine.shell(
        "useradd member; useradd stranger; echo secret >/root/secret; chmod 755 /root; chmod 644 /root/secret"
    )
    return everything(machine)


def install(machine: Machine) -> str:
    return machine.shell("PIP_NO_INDEX=1 PIP_FIND_LINKS=/wheels make --no-print-directory -C /src install")


@pytest.fixture(scope="module")
def installed(machine: Machine, bare: set[str]) -> str:
    assert not any("touchd" in name for name in bare if "touchd-test-packages" not in name)
    return install(machine)


@pytest.fixture(scope="module")
def client(machine: Machine, installed: str) -> Iterator[Hearing]:  # noqa: ARG001
    with machine.in_its_network(Mailbox) as box:
        yield Hearing(box)


def config_for(client: Hearing) -> str:
    return f"""\
source: {{kind: synthetic}}
calibration: {{frames: 30}}
outputs: [{{tuio: {{to: ["{client.destination}"]}}}}]
"""


@pytest.fixture(scope="module")
def touchd(machine: Machine, client: Hearing) -> Unit:
    """The service, with a config, not started."""
    machine.write(CONFIG, config_for(client))
    return Unit(machine, "touchd.service")


@pytest.fixture
def running(touchd: Unit) -> Unit:
    """The service, running and finding touches."""
    touchd.ctl("start")
    wait_until(lambda: touchd.show("StatusText").startswith("tracking"), lambda: touchd.show("StatusText"))
    return touchd


def test_installing_says_what_to_do_next_in_three_lines(machine: Machine, installed: str) -> None:
    first = installed.splitlines().index("touchd is installed in /opt/touchd. Next:")
    assert [line.split()[0] for line in installed.splitlines()[first + 1 : first + 4]] == ["1.", "2.", "3."]
    assert re.fullmatch(r"touchd \d+\.\d+\.\d+\n", machine.run("touchd", "--version"))


@pytest.mark.usefixtures("installed")
def test_the_default_config_is_installed_and_right(machine: Machine) -> None:
    assert machine.run("touchd", "check-config", "--config", CONFIG) == f"{CONFIG}: right\n"


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("unit", ["touchd.service", "touchd@left.service"])
def test_systemd_finds_nothing_to_say_against_the_units(unit: str, machine: Machine) -> None:
    assert machine.run("systemd-analyze", "verify", unit) == ""


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("unit", ["touchd.service", "touchd@left.service"])
def test_the_units_exposure_is_low(unit: str, machine: Machine) -> None:
    said = machine.run("systemd-analyze", "security", "--no-pager", unit)
    found = re.search(r"Overall exposure level for \S+: ([\d.]+)", said)
    assert found is not None, said
    assert float(found[1]) <= WORST_EXPOSURE


@pytest.mark.usefixtures("installed")
def test_the_udev_rule_and_the_user_are_as_systemd_wants_them(machine: Machine) -> None:
    assert machine.shell("id -nG touchd").split() == ["touchd"]
    dry = machine.run("systemd-sysusers", "--dry-run", "/usr/local/lib/sysusers.d/touchd.conf")
    assert "Creating" not in dry
    assert "rror" not in machine.run("udevadm", "test", "/devices/virtual/mem/null").partition("60-touchd.rules")[2]


def test_start_returns_when_touchd_is_ready_and_its_status_is_in_words(touchd: Unit) -> None:
    touchd.ctl("start")
    assert touchd.show("ActiveState") == "active"
    touchd.wait_for("state: tracking")
    wait_until(lambda: "tracking" in touchd.show("StatusText"), lambda: touchd.show("StatusText"))
    assert touchd.show("StatusText") in touchd.ctl("status")


def test_touches_reach_a_client(running: Unit, client: Hearing) -> None:
    client.wait_for_a_touch()
    assert running.show("NRestarts") == "0"


def test_sigusr1_calibrates_again(running: Unit) -> None:
    running.forget()
    running.ctl("kill", "--kill-whom=main", "--signal=USR1")
    running.wait_for("recalibrating: SIGUSR1")
    running.wait_for("state: calibrating")
    running.wait_for("state: tracking")
    assert running.show("NRestarts") == "0"


def test_an_edited_config_is_taken_up_and_a_reload_looks_at_it_again(
    running: Unit, machine: Machine, client: Hearing
) -> None:
    running.forget()
    before = running.show("MainPID")
    machine.write(CONFIG, config_for(client) + "tracking: {coast_ms: 60}\n")
    running.wait_for("config: ")
    assert not any("nothing changed" in line for line in running.journal())
    running.ctl("reload")
    running.wait_for("config: nothing changed")
    running.wait_for("Reloaded touchd.service")
    running.wait_to_be("ActiveState", "active")
    assert running.show("MainPID") == before
    client.wait_for_a_touch()


def test_a_bad_edit_leaves_touch_running_and_is_in_the_status(running: Unit, machine: Machine, client: Hearing) -> None:
    running.forget()
    machine.write(CONFIG, config_for(client) + "tracking: {coast_ms: soon}\n")
    running.ctl("reload")
    running.wait_for("coast_ms")
    wait_until(lambda: "config" in running.show("StatusText"), lambda: running.show("StatusText"))
    client.wait_for_a_touch()
    machine.write(CONFIG, config_for(client))
    wait_until(lambda: "config" not in running.show("StatusText"), lambda: running.show("StatusText"))


def test_state_is_kept_over_a_restart(running: Unit) -> None:
    running.forget()
    running.ctl("restart")
    running.wait_for("using the surface in /var/lib/touchd/surface.touchd")
    running.wait_for("state: tracking")
    assert not any("state: calibrating" in line for line in running.journal())


def test_stopped_it_lifts_all_touches_and_leaves_no_failure(running: Unit, client: Hearing) -> None:
    client.wait_for_a_touch()
    running.ctl("stop")
    assert running.show("ActiveState") == "inactive"
    assert running.show("Result") == "success"
    assert client.heard()[-1].alive == ()


def test_killed_in_the_middle_of_a_touch_it_is_lifted_and_started_again(running: Unit, client: Hearing) -> None:
    running.forget()
    before = running.show("MainPID")
    client.wait_for_a_touch()
    running.ctl("kill", "--kill-whom=main", "--signal=KILL")
    running.wait_for(f"{client.destination}: all touches lifted")
    assert [(bundle.alive, bundle.fseq) for bundle in client.heard()[-3:]] == [((), -1)] * 3
    running.wait_for("state: tracking")
    running.wait_to_be("NRestarts", "1")
    assert running.show("MainPID") not in (before, "0")
    client.wait_for_a_touch()


def test_a_hanging_touchd_is_killed_by_the_watchdog_and_started_again(running: Unit, client: Hearing) -> None:
    running.forget()
    restarts = int(running.show("NRestarts"))
    running.ctl("kill", "--kill-whom=main", "--signal=STOP")
    running.wait_for("Watchdog timeout (limit 10s)!")
    running.wait_to_be("NRestarts", str(restarts + 1))
    running.wait_for("state: tracking")
    client.wait_for_a_touch()


def test_a_bad_config_at_the_start_is_told_once_and_not_tried_again(
    touchd: Unit, machine: Machine, client: Hearing
) -> None:
    touchd.ctl("stop")
    touchd.forget()
    machine.write(CONFIG, "sauce: {kind: recording}\n")
    touchd.ctl("start", check=False)
    touchd.wait_to_be("ActiveState", "failed")
    assert touchd.show("ExecMainStatus") == "78"
    assert touchd.show("NRestarts") == "0"
    assert f"{CONFIG}:1:1" in "\n".join(touchd.journal())
    machine.write(CONFIG, config_for(client))
    touchd.ctl("start")
    assert touchd.show("ActiveState") == "active"


def test_only_members_of_the_group_may_use_the_control_socket(running: Unit, machine: Machine) -> None:
    machine.shell("usermod --append --groups touchd member")
    assert machine.run("stat", "--format=%U %G %A", "/run/touchd/control.sock") == "touchd touchd srw-rw----\n"
    assert "tracking" in machine.run("runuser", "-u", "member", "--", "touchd", "status")
    refused = machine.run("runuser", "-u", "stranger", "--", "touchd", "status", check=False)
    assert "group touchd" in refused
    assert running.show("ActiveState") == "active"


def test_two_tables_run_side_by_side_and_one_stops_alone(machine: Machine, touchd: Unit) -> None:
    left, right = (Unit(machine, f"touchd@{name}.service") for name in ("left", "right"))
    with machine.in_its_network(Mailbox) as left_box, machine.in_its_network(Mailbox) as right_box:
        clients = {left: Hearing(left_box), right: Hearing(right_box)}
        for unit, hearing in clients.items():
            name = unit.name.partition("@")[2].partition(".")[0]
            machine.write(f"/etc/touchd/{name}.yaml", config_for(hearing))
            unit.ctl("start")
        for unit, hearing in clients.items():
            unit.wait_for("state: tracking")
            hearing.wait_for_a_touch()
        sources = {bundle.source for hearing in clients.values() for bundle in hearing.heard()}
        assert len(sources) == 2
        touchd.ctl("stop")
        left.ctl("stop")
        clients[right].wait_for_a_touch()
        machine.shell("test -S /run/touchd-right/control.sock -a -e /var/lib/touchd/right/surface.touchd")
        machine.shell("test ! -e /run/touchd-left -a -e /var/lib/touchd/left/surface.touchd")
        right.ctl("stop")


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


def test_no_permission_was_in_the_way(machine: Machine, touchd: Unit) -> None:
    said = machine.run("journalctl", "--boot", "--output=cat", "--no-pager", "-u", touchd.name, "-u", "touchd@*")
    assert not re.findall(r"(?i).*(?:denied|not permitted|read-only|traceback).*", said)


def test_installing_again_keeps_the_edited_config_and_goes_on_running(
    machine: Machine, touchd: Unit, client: Hearing
) -> None:
    touchd.ctl("start")
    before = touchd.show("MainPID")
    said = install(machine)
    assert f"kept: {CONFIG} has been edited; the new default is /opt/touchd/share/touchd.yaml" in said
    touchd.wait_to_be("ActiveState", "active")
    assert touchd.show("MainPID") != before
    client.wait_for_a_touch()


def test_uninstalling_leaves_nothing_but_a_named_copy_of_the_edited_config(
    machine: Machine, bare: set[str], touchd: Unit
) -> None:
    machine.shell("systemctl enable --now touchd touchd@right")
    said = machine.run("make", "--no-print-directory", "-C", "/src", "uninstall")
    found = re.search(r"Your edited config was saved to (/var/backups/\S+)\.\n", said)
    assert found is not None, said
    assert set(machine.run("tar", "--list", "--file", found[1]).split()) == {
        f"etc/touchd/{name}.yaml" for name in ("left", "right", "touchd")
    }
    machine.run("rm", found[1])
    assert everything(machine) - bare == set()
    assert bare - everything(machine) == set()
    assert machine.run("systemctl", "list-units", "--all", "--no-legend", "touchd*") == ""
    assert touchd.show("LoadState") == "not-found"
    assert machine.shell("ls /run | grep touchd", check=False) == ""
