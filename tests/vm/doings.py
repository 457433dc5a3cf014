"""What the checks do in the machine besides asking systemd: install, configure, listen as a TUIO client."""

from clients.bundles import Bundle, Mailbox, read_bundle
from vm.machine import Machine
from vm.unit import wait_until

CONFIG = "/etc/touchd/touchd.yaml"
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


def everything(machine: Machine) -> set[str]:
    """Return all files, users and groups, but those that pass."""
    passing = " -o ".join(f"-path {folder}" for folder in PASSING)
    files = machine.shell(f"find / \\( {passing} \\) -prune -o -print").splitlines()
    return {*files, *machine.shell("getent passwd; getent group").splitlines()}


def install(machine: Machine) -> str:
    return machine.shell("PIP_NO_INDEX=1 PIP_FIND_LINKS=/wheels make --no-print-directory -C /src install")


def config_for(client: Hearing) -> str:
    return f"""\
source: {{kind: synthetic}}
calibration: {{frames: 30}}
outputs: [{{tuio: {{to: ["{client.destination}"]}}}}]
"""
