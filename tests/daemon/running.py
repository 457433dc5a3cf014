"""`touchd run` in a process of its own."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from clients.harness import PATIENCE_S

TOUCHD = (sys.executable, "-m", "touchd")
# May read everything, as the Python of a root's home is not everyone's to read, and write nothing.
AS_NOBODY = (
    *("setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"),
    *("--inh-caps=-all,+dac_read_search", "--ambient-caps=-all,+dac_read_search"),
    *TOUCHD,
)


class RunningDaemon:
    """`touchd run` in a process of its own, whose log can be waited for."""

    def __init__(self, config: Path, state: Path, touchd: Sequence[str]) -> None:
        self.lines: list[str] = []
        self._said = threading.Condition()
        self.process = subprocess.Popen(
            [*touchd, "run", "--config", config],
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "STATE_DIRECTORY": str(state)},
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        for line in self.process.stderr:
            with self._said:
                self.lines.append(line.rstrip("\n"))
                self._said.notify_all()

    def wait_for(self, text: str, times: int = 1) -> None:
        with self._said:
            found = self._said.wait_for(lambda: sum(text in line for line in self.lines) >= times, PATIENCE_S)
        assert found, f"{text!r} was not said {times} times: {self.lines}"

    def said(self, text: str, times: int = 1) -> bool:
        with self._said:
            return sum(text in line for line in self.lines) >= times

    def end(self, number: signal.Signals) -> int:
        self.process.send_signal(number)
        code = self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return code


@contextmanager
def running(config: Path, state: Path, touchd: Sequence[str] = TOUCHD) -> Iterator[RunningDaemon]:
    daemon = RunningDaemon(config, state, touchd)
    try:
        yield daemon
    finally:
        if daemon.process.poll() is None:
            daemon.process.kill()
        daemon.process.wait()
        daemon._reader.join(PATIENCE_S)
        assert daemon.process.stderr is not None
        daemon.process.stderr.close()


def wait_until(happened: Callable[[], bool]) -> None:
    for _ in range(round(PATIENCE_S / 0.01)):
        if happened():
            return
        time.sleep(0.01)
    pytest.fail("it did not happen")
