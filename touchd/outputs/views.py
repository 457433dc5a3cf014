"""What of a frame one destination is told, by the profile that is sent there; the simplest is here."""

from collections.abc import Sequence
from typing import Protocol

from touchd.model import TouchFrame
from touchd.outputs.screen import Screen
from touchd.outputs.things import Thing


class View(Protocol):
    """From frames of tracking to the things that one destination's client gets, in its coordinates."""

    def of(self, frame: TouchFrame, /) -> Sequence[Thing]:
        """Return what the client gets of the next frame, each under an id that never comes back once it has gone."""

    def end_all(self) -> None:
        """Forget everything: nothing is tracked any more."""


class Touches:
    """The touches as they are: profile 2Dcur."""

    def __init__(self, screen: Screen) -> None:
        self._screen = screen

    def of(self, frame: TouchFrame) -> Sequence[Thing]:
        """Return the client's cursors."""
        return self._screen.view(frame.cursors)

    def end_all(self) -> None:
        """Forget the touches."""
        self._screen.view(())
