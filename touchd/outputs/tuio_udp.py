"""TUIO over UDP as an output: what is sent when, from the first bundle that clears to the last."""

from collections.abc import Sequence

from touchd.model import State, TouchFrame
from touchd.outputs.output import OutputStatus
from touchd.outputs.profiles import CURSOR_2D
from touchd.outputs.screen import Screen
from touchd.outputs.things import Thing
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.udp import DestinationStatus, UdpSender
from touchd.outputs.views import Touches, View

_CLEAR_COPIES = 3  # nothing repeats a clear later, so that one lost datagram must not matter
_IDLE_NS = 1_000_000_000
_FAREWELLS = 3  # frames that say that nothing is there any more: a lost one must not leave a touch for a second


class TuioUdpOutput:
    """Sends each frame that has something to tell, the three after the last such one, and an empty one when idle.

    Takes ``encoder`` and ``sender`` for its own and closes the latter. In a state other than "tracking" there
    is nothing to tell, whatever the frame holds. ``view`` is what the clients get, of the encoder's profile; None:
    all touches.
    """

    def __init__(self, encoder: TuioEncoder, sender: UdpSender, view: View | None = None) -> None:
        self._encoder = encoder
        self._view = view or Touches(Screen())
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
        things = self._view.of(frame) if tracking else ()
        if things or self._farewells:
            self._send(things, now_ns)
        else:
            self.tick(now_ns)
        if not tracking:
            self._view.end_all()
            if was_live:
                self._clear()

    def tick(self, now_ns: int) -> None:
        """Send an empty alive if there is nothing to tell and nothing was sent for a second.

        So a client that missed the last removal holds what it removed for no longer than that.
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
            name=f"{self._name()} to " + ", ".join(one.destination for one in each),
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

    def _name(self) -> str:
        profile = self._encoder.profile
        return "tuio" if profile == CURSOR_2D.name else f"tuio {profile}"

    def _send(self, things: Sequence[Thing], now_ns: int) -> None:
        frame = self._encoder.next_frame(things)
        self._sender.send(frame)
        self._live = bool(frame.session_ids)
        self._farewells = _FAREWELLS if self._live else max(0, self._farewells - 1)
        self._last_sent_ns = now_ns

    def _clear(self) -> None:
        self._sender.send_bytes(self._encoder.clear(), _CLEAR_COPIES)
