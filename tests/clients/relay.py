"""A UDP path that loses datagrams and lets neighbours change places, as a network may."""

import random
import socket
import threading
from types import TracebackType
from typing import Self

PATIENCE_S = 30.0
RESEND_S = 0.5
RECEIVE_BUFFER_BYTES = 1 << 22
_END = 0


class LossyRelay:
    """Forwards what is sent to ``destination`` on loopback to one client, but for what chance takes or delays.

    Each datagram is lost with probability ``loss``; else it changes places with the next one that is not lost, with
    probability ``swap``. One whose successor is not there after ``hold_s`` goes alone. Which datagrams these are
    depends on ``seed`` and on how many came before, on nothing else.
    """

    def __init__(self, to: str, loss: float, swap: float, seed: int, hold_s: float = 0.05) -> None:
        self.lost = 0
        self.swapped = 0  # pairs that changed places
        host, _, port = to.rpartition(":")
        self._to = (host, int(port))
        self._loss = loss
        self._swap = swap
        self._chance = random.Random(seed)
        self._hold_s = hold_s
        self._held: bytes | None = None
        self._marks = 0
        self._mark_seen = 0
        self._changed = threading.Condition()

    def __enter__(self) -> Self:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self._socket.bind(("127.0.0.1", 0))
        self._own = self._socket.getsockname()
        self.destination = f"127.0.0.1:{self._own[1]}"
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Forward all that was sent before, also what is held back, and end."""
        self._send_mark(_END)
        self._thread.join(PATIENCE_S)
        self._socket.close()

    def sync(self) -> None:
        """Wait until all that was sent before was forwarded or lost, but for one that may be held back."""
        self._marks += 1
        for _ in range(round(PATIENCE_S / RESEND_S)):
            self._send_mark(self._marks)
            with self._changed:
                if self._changed.wait_for(lambda: self._mark_seen >= self._marks, RESEND_S):
                    return
        raise TimeoutError(f"The relay at {self.destination} did not come to the end within {PATIENCE_S} s.")

    def _send_mark(self, number: int) -> None:
        self._socket.sendto(number.to_bytes(4), self._own)

    def _run(self) -> None:
        while True:
            self._socket.settimeout(None if self._held is None else self._hold_s)
            try:
                datagram, sender = self._socket.recvfrom(65536)
            except TimeoutError:
                self._release()
                continue
            if sender != self._own:
                self._take(datagram)
            elif (mark := int.from_bytes(datagram)) == _END:
                self._release()
                return
            else:
                self._note(mark)

    def _take(self, datagram: bytes) -> None:
        is_lost = self._chance.random() < self._loss
        is_delayed = self._chance.random() < self._swap
        if is_lost:
            self.lost += 1
        elif self._held is not None:
            self._forward(datagram)
            self._release()
            self.swapped += 1
        elif is_delayed:
            self._held = datagram
        else:
            self._forward(datagram)

    def _release(self) -> None:
        if self._held is not None:
            self._forward(self._held)
            self._held = None

    def _forward(self, datagram: bytes) -> None:
        self._socket.sendto(datagram, self._to)

    def _note(self, mark: int) -> None:
        with self._changed:
            self._mark_seen = max(self._mark_seen, mark)
            self._changed.notify_all()
