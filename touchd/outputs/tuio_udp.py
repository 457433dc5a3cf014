"""TUIO over UDP as an output: what is sent when, from the first bundle that clears to the last."""

from collections.abc import Sequence

from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.output import OutputStatus
from touchd.outputs.screen import Screen
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.udp import DestinationStatus, UdpSender

_CLEAR_COPIES = 3  # nothing repeats a clear later, so that one lost datagram must not matter
_IDLE_NS = 1_000_000_000
_FAREWELLS = 3  # frames that say that nobody touches any more: a lost one must not leave a touch for a second


class TuioUdpOutput:
    """Sends each frame that has cursors, the three after the last of them left, and an empty one when idle.

    Takes ``encoder`` and ``sender`` for its own and closes the latter. In a state other than "tracking" there
    are no cursors, whatever the frame holds. ``screen`` is what of them the clients get; None: all that fit.
    """

    def __init__(self, encoder: TuioEncoder, sender: UdpSender, screen: Screen | None = None) -> None:
        self._encoder = encoder
        self._screen = screen or Screen()
        self._sender = sender
        self._live = False
        self._farewells = 0
        self._last_sent_ns: int | None = None

    def start(self) -> None:
        """End what clients still hold of a run that could not say goodbye."""
        self._clear()

    def publish(self, frame: TouchFrame, now_ns: int) -> None:
        """Send what clients must know of ``frame``; a state without tracking ends all touches for good."""
        tracking = frame.state is State.TRACKING
        was_live = self._live
        cursors = self._screen.view(frame.cursors if tracking else ())
        if cursors or self._farewells:
            self._send(cursors, now_ns)
        else:
            self.tick(now_ns)
        if was_live and not tracking:
            self._clear()

    def tick(self, now_ns: int) -> None:
        """Send an empty alive if there is no cursor and nothing was sent for a second.

        So a client that missed the last removal holds its cursor for no longer than that.
        """
        idle = self._last_sent_ns is None or now_ns - self._last_sent_ns >= _IDLE_NS
        if idle and not self._live:
            self._send((), now_ns)

    def close(self) -> None:
        """End all touches, as a frame of its own and for good, and close the sockets."""
        self._sender.send(self._encoder.next_frame(()))
        self._clear()
        self._sender.close()

    def status(self) -> OutputStatus:
        """Return the sums over all destinations, and the error of the first that has one."""
        each = self._sender.status()
        return OutputStatus(
            name="tuio to " + ", ".join(one.destination for one in each),
            sent=sum(one.sent for one in each),
            failed=sum(one.failed for one in each),
            dropped=0,
            last_error=next((one.last_error for one in each if one.last_error is not None), None),
        )

    def destinations(self) -> tuple[DestinationStatus, ...]:
        """Return how each destination fares."""
        return self._sender.status()

    @property
    def last_fseq(self) -> int:
        """The fseq sent last, to be kept for the next run."""
        return self._encoder.last_fseq

    def _send(self, cursors: Sequence[Cursor], now_ns: int) -> None:
        frame = self._encoder.next_frame(cursors)
        self._sender.send(frame)
        self._live = bool(frame.session_ids)
        self._farewells = _FAREWELLS if self._live else max(0, self._farewells - 1)
        self._last_sent_ns = now_ns

    def _clear(self) -> None:
        self._sender.send_bytes(self._encoder.clear(), _CLEAR_COPIES)
