"""A TUIO client that checks every datagram and, however long it listens, remembers only what it must."""

import math
import socket
import struct
import threading
from types import TracebackType
from typing import Self

from touchd.outputs.tuio import FSEQ_MAX, SESSION_ID_MAX

from clients.bundles import Bundle, read_bundle
from soak.lockstep import PATIENCE_S

_MAX_BYTES = 4096
_FAULTS_KEPT = 10
_MARK = struct.Struct(">8sI")
_MARK_HEAD = b"the mark"


class StrictClient:
    """Listens on loopback from a thread of its own, as a context. Nothing may be lost on the way, so nothing may miss.

    A frame number must follow the one before; after an empty bundle that clears, it must be ahead of it. A session id
    that appears must be ahead of all before it, so that none ever comes twice. "Ahead" holds across the wrap at
    2**31 - 1, as in RFC 1982.
    """

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.destination = f"127.0.0.1:{self._socket.getsockname()[1]}"
        self.held: frozenset[int] = frozenset()
        self.datagrams = self.touches = self.faults_found = 0
        self.fseq = self.highest_id = 0  # 0: none so far
        self.fseq_wraps = self.id_wraps = 0
        self.faults: list[str] = []  # the first few
        self._source: str | None = None
        self._cleared = False
        self._marks_sent = 0
        self._marks_seen = threading.Semaphore(0)
        self._thread = threading.Thread(target=self._listen, name="client", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._socket.sendto(b"", self._socket.getsockname())
        self._thread.join(PATIENCE_S)
        self._socket.close()

    def catch_up(self) -> None:
        """Wait until all that was sent before has been checked. Raises TimeoutError."""
        self._marks_sent += 1
        self._socket.sendto(_MARK.pack(_MARK_HEAD, self._marks_sent % 2**32), self._socket.getsockname())
        if not self._marks_seen.acquire(timeout=PATIENCE_S):
            raise TimeoutError(f"the client did not come to its mark within {PATIENCE_S:.0f} s")

    def summary(self) -> str:
        """Return what it got, for people."""
        return (
            f"{self.destination}: {self.datagrams} datagrams, {self.touches} touches; "
            f"fseq came round {self.fseq_wraps} times, session ids {self.id_wraps} times"
        )

    def verdict(self) -> list[str]:
        """Return what was wrong with all that it got, now that the sender has ended."""
        found = [*self.faults]
        if self.faults_found > len(found):
            found.append(f"{self.faults_found - len(found)} more faults at {self.destination}")
        if self.held:
            found.append(f"{self.destination} still holds {sorted(self.held)}")
        if not self.touches:
            found.append(f"{self.destination} saw no touch at all")
        return found

    def take(self, datagram: bytes) -> None:
        """Check one datagram."""
        self.datagrams += 1
        if len(datagram) > _MAX_BYTES:
            self._fault(f"it has {len(datagram)} bytes")
        try:
            bundle = read_bundle(datagram)
        except Exception as error:  # noqa: BLE001  whatever is wrong with it, it is wrong
            self._fault(f"it cannot be read: {error!r}")
            return
        if bundle.source != (self._source or bundle.source):
            self._fault(f"its source is {bundle.source!r} after {self._source!r}")
        self._source = bundle.source
        if bundle.fseq == -1:
            self._clear(bundle)
        else:
            self._follow(bundle.fseq)
            self._hold(bundle)

    def _listen(self) -> None:
        while datagram := self._socket.recv(65536):
            if datagram.startswith(_MARK_HEAD):
                self._marks_seen.release()
            else:
                self.take(datagram)

    def _clear(self, bundle: Bundle) -> None:
        if bundle.alive:
            self._fault(f"it clears and lists {bundle.alive} as alive")
        self.held = frozenset()
        self._cleared = True

    def _follow(self, fseq: int) -> None:
        if not 1 <= fseq <= FSEQ_MAX:
            self._fault(f"its fseq is {fseq}")
        step = (fseq - self.fseq) % FSEQ_MAX
        if self.fseq and not (step == 1 or (self._cleared and 1 <= step < 2**30)):
            self._fault(f"its fseq is {fseq} after {self.fseq}")
        self.fseq_wraps += fseq < self.fseq
        self.fseq = fseq
        self._cleared = False

    def _hold(self, bundle: Bundle) -> None:
        if len(set(bundle.alive)) != len(bundle.alive) or set(bundle.sets) != set(bundle.alive):
            self._fault(f"it sets {sorted(bundle.sets)} and lists {bundle.alive} as alive")
        for session_id in bundle.alive:
            if session_id not in self.held:
                self._begin(session_id)
        for session_id, (x, y, *others) in bundle.sets.items():
            if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0 and x + y > 0.0 and all(map(math.isfinite, others))):
                self._fault(f"it sets {session_id} to {x}, {y}, {others}")
        self.held = frozenset(bundle.alive)

    def _begin(self, session_id: int) -> None:
        self.touches += 1
        if not 1 <= session_id <= SESSION_ID_MAX:
            self._fault(f"it begins the session {session_id}")
        if self.highest_id and not 1 <= (session_id - self.highest_id) % SESSION_ID_MAX < 2**30:
            self._fault(f"it begins the session {session_id} after {self.highest_id}")
        self.id_wraps += session_id < self.highest_id
        self.highest_id = session_id

    def _fault(self, what: str) -> None:
        self.faults_found += 1
        if len(self.faults) < _FAULTS_KEPT:
            self.faults.append(f"datagram {self.datagrams} at {self.destination}: {what}")
