"""Kivy's TUIO provider, asked as Kivy's main loop asks it; see process_client.py for what this writes and reads."""

import json
import os
import select
import socket
import sys
import threading

FRAME_S = 0.005  # how long Kivy's main loop rests
LOOK_AGAIN_S = 0.05


def say(*words: object) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


try:
    import oscpy  # noqa: F401  # which the provider imports when it starts
    from kivy.input import MotionEvent
    from kivy.input.providers.tuio import TuioMotionEventProvider
except ImportError as error:
    say("missing", f"Kivy is not installed ({error}): pip install 'touchd[test]'")
    sys.exit()


class ThreadMark:
    """Tells that the provider's thread is done with all that it has read before.

    The thread reads its sockets in turn, so a datagram to a second one, of no TUIO, comes after what was read.
    """

    def __init__(self, provider: TuioMotionEventProvider) -> None:
        self._server = provider.oscid
        self._reached = threading.Event()
        inbox = self._server.listen("127.0.0.1", 0)
        self._server.bind(b"/mark", self._reached.set, inbox)
        self._address = self._server.getaddress(inbox)

    def wait(self) -> bool:
        """Return whether the thread came so far; else it has ended."""
        self._reached.clear()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"/mark\0\0\0,\0\0\0", self._address)
        while not self._reached.wait(LOOK_AGAIN_S):
            if self._server.join_server(0.0):
                return False
        return True


def dispatch(kind: str, touch: MotionEvent) -> None:
    position = touch.sx, 1.0 - touch.sy
    match kind:
        case "begin":
            say("add", touch.id, *position)
        case "update":
            say("move", touch.id, *position)
        case "end":
            say("remove", touch.id)


def main(port: str) -> None:
    provider = TuioMotionEventProvider("tuio", f"127.0.0.1:{port}")
    provider.start()
    mark = ThreadMark(provider)
    say("ready")
    while True:
        pinged, _, _ = select.select([0], [], [], FRAME_S)
        pings = os.read(0, 4096).split() if pinged else []
        if pinged and not pings:
            return
        if pings and not mark.wait():
            say("fault", "Kivy's TUIO thread has ended.")
        provider.update(dispatch)
        for number in pings:
            say("pong", int(number))


if __name__ == "__main__":
    main(sys.argv[1])
