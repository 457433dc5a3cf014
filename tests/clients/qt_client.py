"""A Qt 6 window that takes touches from the TuioTouch plugin; see process_client.py for what it writes and reads."""

import json
import os
import sys

REMEDY = (
    "pip install 'touchd[test]'; "
    "apt-get install libegl1 libgl1 libxkbcommon0 libdbus-1-3 libfontconfig1 libglib2.0-0 libgssapi-krb5-2"
)


def say(*words: object) -> None:
    sys.stdout.write(json.dumps(words) + "\n")
    sys.stdout.flush()


try:
    from PySide6 import QtCore, QtGui, QtNetwork  # noqa: F401  # the plugin needs QtNetwork's libraries
except ImportError as error:
    say("missing", f"Qt is not installed ({error}): {REMEDY}")
    sys.exit()


class Window(QtGui.QRasterWindow):
    """Says what its touch events hold. Qt gives the ids of TUIO's sessions as they are on the wire."""

    def event(self, event: QtCore.QEvent) -> bool:
        if event.type() == QtCore.QEvent.Type.TouchCancel:
            say("fault", "Qt cancelled its touches.")
        return super().event(event)

    def touchEvent(self, event: QtGui.QTouchEvent) -> None:  # noqa: N802  # Qt's name
        for point in event.points():
            position = point.position()
            x, y = position.x() / self.width(), position.y() / self.height()
            match point.state():
                case QtGui.QEventPoint.State.Pressed:
                    say("add", point.id(), x, y)
                case QtGui.QEventPoint.State.Updated:
                    say("move", point.id(), x, y)
                case QtGui.QEventPoint.State.Released:
                    say("remove", point.id())


def answer(app: QtGui.QGuiApplication) -> None:
    """Answer pings: sync() hands out what the plugin has queued."""
    pings = os.read(0, 4096).split()
    if not pings:
        app.quit()
    for number in pings:
        app.sync()
        say("pong", int(number))


def main(port: str) -> None:
    app = QtGui.QGuiApplication([sys.argv[0], "-plugin", f"TuioTouch:udp={port}"])
    window = Window()
    app.focusWindowChanged.connect(lambda focused: say("ready") if focused is window else None)
    window.showFullScreen()
    window.requestActivate()  # the plugin drops what comes while no window is active
    pings = QtCore.QSocketNotifier(0, QtCore.QSocketNotifier.Type.Read)
    pings.activated.connect(lambda: answer(app))
    app.exec()


if __name__ == "__main__":
    main(sys.argv[1])
