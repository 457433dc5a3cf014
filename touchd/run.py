"""`touchd run`: the service under its signals, its control socket and systemd, until it is told to stop."""

import logging
import os
import signal
import time
from collections.abc import Collection
from pathlib import Path

import cv2

from touchd.control.errors import ControlError
from touchd.control.paths import control_socket_path
from touchd.control.server import ControlServer
from touchd.controls import ServiceControls
from touchd.daemon import Daemon
from touchd.errors import StateNotKept
from touchd.notify import Notifier
from touchd.service import Service
from touchd.state import Lock, state_folder
from touchd.status.text import sentence

log = logging.getLogger(__name__)

SIGNALS = frozenset({signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGHUP})
_LOOK_S = 0.2
_NAP_S = 0.05


def run(config_path: Path | None) -> None:
    """Run until a signal says stop; all of ``SIGNALS`` must be blocked already. Raises TouchdError."""
    cv2.setNumThreads(1)
    folder = state_folder(os.environ)
    lock = _lock(folder)
    try:
        service = Service(config_path, folder)
        controls = ServiceControls(service)
        log.info("source: %s", service.daemon.source.name)
        service.start()
        server = _serve(controls)
        try:
            _until_stopped(service, Heart(Notifier(os.environ), controls))
        finally:
            service.close_requests()
            service.stop()
            if server is not None:
                server.stop()
    finally:
        if lock is not None:
            lock.release()


def _lock(folder: Path) -> Lock | None:
    """Take the state folder for this daemon alone; None where it cannot be written to, which stops no touch."""
    try:
        return Lock(folder)
    except StateNotKept as error:
        log.warning("running without a state folder, so the surface is learned at each start: %s", error)
        return None


def _serve(controls: ServiceControls) -> ControlServer | None:
    """Answer at the control socket; None where it cannot be made, which stops no touch."""
    server = ControlServer(control_socket_path(os.environ), controls)
    try:
        server.start()
    except ControlError as error:
        log.warning("running without a control socket: %s", error)
        return None
    return server


class Heart:
    """Tells systemd how the service fares, and that it lives: frames flow or the source knows what it waits for."""

    _ALIVE_WITHIN_S = 3.0

    def __init__(self, notifier: Notifier, controls: ServiceControls) -> None:
        self._notifier = notifier
        self._controls = controls
        self._beat_s = 0.0

    @property
    def notifier(self) -> Notifier:
        """What it tells."""
        return self._notifier

    def beat(self, daemon: Daemon) -> None:
        """Call it a few times a second."""
        now_s = time.monotonic()
        if now_s - self._beat_s < min(1.0, self._notifier.watchdog_interval_s or 1.0):
            return
        self._beat_s = now_s
        self._notifier.status(sentence(self._controls.status()))
        if daemon.alive(self._ALIVE_WITHIN_S):
            self._notifier.watchdog()


def _until_stopped(service: Service, heart: Heart) -> None:
    """Serve signals: SIGTERM and SIGINT return, SIGUSR1 recalibrates, SIGHUP reloads."""
    heart.notifier.ready()
    while not service.daemon.stopping.is_set():
        received = next_signal(SIGNALS, _LOOK_S)
        service.look()
        heart.beat(service.daemon)
        if received is None:
            continue
        name = received.name
        if received is signal.SIGUSR1:
            log.info("recalibrating: %s", name)
            service.recalibrate()
        elif received is signal.SIGHUP:
            heart.notifier.reloading()
            service.reload_and_log()
            heart.notifier.ready()
        else:
            log.info("stopping: %s", name)
            heart.notifier.stopping()
            return


def next_signal(signals: Collection[signal.Signals], timeout_s: float) -> signal.Signals | None:
    """Wait up to ``timeout_s`` for one of these signals, all of them blocked; None if none came.

    Python's own sigtimedwait() returns nonsense where the process was stopped and continued while it waited, as by
    Ctrl-Z and fg (seen with CPython 3.11). So it is never made to wait.
    """
    until_s = time.monotonic() + timeout_s
    while True:
        received = signal.sigtimedwait(signals, 0)
        if received is not None:
            return signal.Signals(received.si_signo)
        left_s = until_s - time.monotonic()
        if left_s <= 0.0:
            return None
        time.sleep(min(left_s, _NAP_S))
