"""Prints every touch that Kivy gets from touchd; needs no window.

pip install kivy oscpy; then: python kivy_touches.py [PORT]
An app with a window needs none of this: docs/tuio.md has the one line for it.
"""

import os
import sys
import time

os.environ["KIVY_NO_ARGS"] = "1"  # else Kivy takes the command line for its own
os.environ["KIVY_LOG_MODE"] = "PYTHON"  # else it swallows error messages

from kivy.input.providers.tuio import TuioMotionEvent, TuioMotionEventProvider

POLL_S = 0.005


def show(kind: str, touch: TuioMotionEvent) -> None:
    """Print one of Kivy's "begin", "update" and "end", with y from the bottom up as Kivy has it."""
    print(f"{kind} {touch.id} {touch.sx:.3f} {touch.sy:.3f}", flush=True)


def main() -> None:
    """Listen on all addresses until interrupted."""
    port = int(sys.argv[1]) if len(sys.argv) > 1 else 3333
    provider = TuioMotionEventProvider("touchd", f"0.0.0.0:{port}")
    provider.start()
    print(f"listening on UDP port {port}", flush=True)
    try:
        while True:
            provider.update(show)
            time.sleep(POLL_S)
    except KeyboardInterrupt:
        provider.stop()


if __name__ == "__main__":
    main()
