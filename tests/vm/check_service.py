"""The service for real, installed and run in a Debian of its own. Run by `make test-vm`, as root."""

import re

import pytest

from clients.bundles import Mailbox
from vm.doings import CONFIG, Hearing, config_for
from vm.machine import Machine
from vm.unit import Unit, wait_until

WORST_EXPOSURE = 1.5
RULE = "/etc/udev/rules.d/60-touchd.rules"


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
    of_the_rule = [
        line for line in machine.run("udevadm", "test", "/devices/virtual/mem/null").splitlines() if RULE in line
    ]
    assert of_the_rule == [f"Reading rules file: {RULE}"]  # what is wrong in it would be further lines


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
