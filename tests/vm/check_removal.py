"""After all that was done to it: no permission was missed, an upgrade goes well, and removal is complete.

Run by `make test-vm`, as root, after the other checks.
"""

import re

from vm.doings import CONFIG, Hearing, everything, install
from vm.machine import Machine
from vm.unit import Unit


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
