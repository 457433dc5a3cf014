"""A Qt 6 window that shows and prints the touches from touchd.

pip install PySide6-Essentials; then: python qt_touches.py [PORT]
"""

import signal
import sys

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QGuiApplication, QPainter, QPaintEvent, QRasterWindow, QTouchEvent

RADIUS_PX = 30


class Touches(QRasterWindow):
    """A circle under each finger. Touches cover the window, whatever its size, so it is best full screen."""

    def __init__(self) -> None:
        super().__init__()
        self._points: list[QTouchEvent.Point] = []

    def touchEvent(self, event: QTouchEvent) -> None:
        """Take all points, those at rest too, and print what became of each."""
        for point in event.points():
            at = point.position()
            print(f"{point.state().name} {point.id()} {at.x() / self.width():.3f} {at.y() / self.height():.3f}")
        sys.stdout.flush()
        self._points = [p for p in event.points() if p.state() != Qt.TouchPointState.TouchPointReleased]
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the circles."""
        with QPainter(self) as painter:
            painter.fillRect(event.rect(), QColor("black"))
            painter.setBrush(QColor("orange"))
            for point in self._points:
                painter.drawEllipse(point.position(), RADIUS_PX, RADIUS_PX)


def main() -> int:
    """Load Qt's TUIO plugin on the port, show the window, and run until it is closed."""
    port = sys.argv[1] if len(sys.argv) > 1 else "3333"
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    app = QGuiApplication([sys.argv[0], "-plugin", f"TuioTouch:udp={port}"])
    window = Touches()
    window.showFullScreen()
    window.requestActivate()  # a window without focus gets no touches
    return app.exec()


if __name__ == "__main__":
    sys.exit(main())
