"""A unit of systemd in the machine: what a person at the keyboard asks of it."""

import time
from collections.abc import Callable

import pytest

from vm.machine import Machine

PATIENCE_S = 30.0
_LOOK_S = 0.1


def wait_until(happened: Callable[[], bool], what: Callable[[], str]) -> None:
    """Wait for what must happen; ``what`` tells what is there instead if it does not."""
    deadline_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline_s:
        if happened():
            return
        time.sleep(_LOOK_S)
    pytest.fail(f"it did not happen within {PATIENCE_S:.0f} s: {what()}")


class Unit:
    """A service by its name."""

    def __init__(self, machine: Machine, name: str) -> None:
        self._machine = machine
        self.name = name
        self._said_before = 0

    def ctl(self, *words: str, check: bool = True) -> str:
        """Run systemctl with the unit as last word."""
        return self._machine.run("systemctl", *words, self.name, check=check)

    def show(self, key: str) -> str:
        """Return one of the unit's properties."""
        return self.ctl("show", "--property", key, "--value").strip()

    def journal(self) -> list[str]:
        """Return the lines that the service and systemd said of it, from the last :meth:`forget` on."""
        command = ("journalctl", "--unit", self.name, "--output=cat", "--no-pager", "--quiet")
        return self._machine.run(*command).splitlines()[self._said_before :]

    def forget(self) -> None:
        """Look only at what will be said from now on."""
        self._said_before += len(self.journal())

    def wait_for(self, text: str) -> None:
        """Wait until a line with this text is said."""
        wait_until(lambda: any(text in line for line in self.journal()), lambda: f"{text!r} in {self.journal()}")

    def wait_to_be(self, key: str, value: str) -> None:
        """Wait until a property has a value."""
        wait_until(lambda: self.show(key) == value, lambda: f"{key} is {self.show(key)!r}: {self.journal()}")
