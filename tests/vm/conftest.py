"""One machine for all checks. They run in the order in which `make test-vm` names their files."""

from collections.abc import Iterator

import pytest

from clients.bundles import Mailbox
from vm.doings import CONFIG, Hearing, config_for, everything, install
from vm.machine import REPOSITORY, Machine, booted, wheels, why_not
from vm.unit import Unit, wait_until


@pytest.fixture(scope="session")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Machine]:
    if reason := why_not():
        pytest.fail(reason)
    console = tmp_path_factory.mktemp("machine") / "console"
    with console.open("wb") as log, booted(log, {REPOSITORY: "/src", wheels(): "/wheels"}) as machine:
        yield machine


@pytest.fixture(scope="session")
def bare(machine: Machine) -> set[str]:
    """What was there before the installation: a Debian with two people."""
    machine.shell(
        "useradd member; useradd stranger; echo secret >/root/secret; chmod 755 /root; chmod 644 /root/secret"
    )
    return everything(machine)


@pytest.fixture(scope="session")
def installed(machine: Machine, bare: set[str]) -> str:
    assert not any("touchd" in name for name in bare if "touchd-test-packages" not in name)
    return install(machine)


@pytest.fixture(scope="session")
def client(machine: Machine, installed: str) -> Iterator[Hearing]:  # noqa: ARG001
    with machine.in_its_network(Mailbox) as box:
        yield Hearing(box)


@pytest.fixture(scope="session")
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
