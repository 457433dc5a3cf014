"""`touchd listen`: hears what arrives at a port, says what it hears, and judges it."""

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from touchd.listen.checker import Checker, Note
from touchd.listen.listener import Listener
from touchd.listen.report import Ledger, LiveLines, Verdict
from touchd.listen.rules import Finding

_LOOK_S = 0.1
_WINDOW_NS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class ListenOptions:
    """What to listen to: ``host`` None is every address; ``seconds`` or ``frames`` end it, else only the stop does."""

    port: int = 3333  # 0: any that is free
    host: str | None = None
    join: str | None = None  # a multicast group
    seconds: float | None = None
    frames: int | None = None
    moves: bool = False
    columns: int = 100


def monitor(options: ListenOptions, say: Callable[[str], None], stop: threading.Event) -> Verdict:
    """Listen until ``stop`` or the end that ``options`` set, and return the verdict. ``say`` gets each line at once.

    :raises PortInUse: when another program has the port.
    :raises UsageError: when the host or the multicast group is not of use here.
    :raises ListenError: when the system refuses for another reason.
    """
    with Listener(options.port, options.host, options.join) as listener:
        say(f"listening on UDP port {listener.port} of {options.host or 'all addresses'}; Ctrl-C ends it")
        watch = _Watch(options, say)
        over = False
        while not over:
            over = stop.is_set() or watch.is_over()
            for each in listener.receive(0.0 if over else _LOOK_S):  # what came before the end counts
                watch.tell(watch.checker.feed(each.datagram, each.address, each.t_ns), each.t_ns)
            watch.tell_rates()
        return watch.verdict(listener)


class _Watch:
    """One listening: the checker, what it found so far, and the words for it."""

    def __init__(self, options: ListenOptions, say: Callable[[str], None]) -> None:
        self.checker = Checker()
        self._options = options
        self._say = say
        self._start_ns = self._window_ns = time.monotonic_ns()
        self._ledger = Ledger()
        self._lines = LiveLines(self._start_ns, options.moves, options.columns)

    def is_over(self) -> bool:
        """Return whether the time or the frames that were asked for have passed."""
        seconds, frames = self._options.seconds, self._options.frames
        if seconds is not None and time.monotonic_ns() - self._start_ns >= seconds * 1e9:
            return True
        return frames is not None and self.checker.frames >= frames

    def tell(self, notes: Iterable[Note], t_ns: int) -> None:
        """Say what happened, a finding only when it is the first of its kind."""
        for note in notes:
            if not isinstance(note, Finding) or self._ledger.note(note):
                for line in self._lines.of_note(note, t_ns):
                    self._say(line)

    def tell_rates(self) -> None:
        """Say once a second what each sender sent in it."""
        now_ns = time.monotonic_ns()
        elapsed_ns = now_ns - self._window_ns
        if elapsed_ns < _WINDOW_NS:
            return
        self._window_ns = now_ns
        for sender in self.checker.senders:
            window = sender.pace.look()
            if window.datagrams:
                for line in self._lines.of_window(sender, window, elapsed_ns, now_ns):
                    self._say(line)

    def verdict(self, listener: Listener) -> Verdict:
        """End the listening, and return what it found."""
        end_ns = time.monotonic_ns()
        self.tell(self.checker.finish(end_ns), end_ns)
        return Verdict(
            port=listener.port,
            start_ns=self._start_ns,
            end_ns=end_ns,
            datagrams=self.checker.datagrams,
            kernel_drops=listener.kernel_drops,
            senders=self.checker.totals(),
            broken=self._ledger.entries,
            columns=self._options.columns,
        )
