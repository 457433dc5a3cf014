"""What a frame's touches need comes first; hands, things and the surface's own life can wait until they are told."""

from collections.abc import Sequence

import pytest
from touchd.hands.stage import HandStage
from touchd.model import CoarsePicture, Mask, Slide, TouchFrame
from touchd.table.misreading import TRUE_READING
from touchd.table.scene import Block, Hand

from living_tables import Desk, finger
from shifting_table import gradient

BOOK = Hand((Block((-160.0, -90.0, 0.0), (148.0, 205.0, 30.0), 20.0),), ())


def visits(desk: Desk, settles: bool) -> list[TouchFrame]:
    """A finger, a book that is put down, a finger on it, and a knock; settled by the caller after each frame or not."""
    results = []
    shows: Sequence[tuple[int, tuple[Hand, ...]]] = (
        (6, (finger(),)),
        (4, ()),
        (12, (BOOK,)),
        (6, (BOOK, finger())),
    )
    for count, hands in shows:
        for _ in range(count):
            results.append(desk.pipeline.step(desk.frame(hands)))
            if settles:
                desk.pipeline.settle()
    desk.shift(gradient(3.0))
    for _ in range(8):
        results.append(desk.pipeline.step(desk.frame((BOOK,))))
        if settles:
            desk.pipeline.settle()
    return results


def test_the_same_frames_show_the_same_whether_the_caller_settles_or_not() -> None:
    assert visits(Desk(750.0), settles=True) == visits(Desk(750.0), settles=False)


class Looks:
    """Counts how often hands and things were looked for."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.count = 0
        see = HandStage.see

        def counted(
            stage: HandStage,
            picture: CoarsePicture,
            t_ns: int,
            joined: Mask | None = None,
            slides: Sequence[Slide] = (),
        ) -> None:
            self.count += 1
            see(stage, picture, t_ns, joined, slides)

        monkeypatch.setattr(HandStage, "see", counted)


def test_hands_are_looked_for_once_touches_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    desk, looks = Desk(750.0), Looks(monkeypatch)
    desk.play(2)
    desk.pipeline.settle()
    before = looks.count
    desk.play(1, finger())
    assert looks.count == before
    desk.pipeline.settle()
    desk.pipeline.settle()
    assert looks.count == before + 1


def test_while_something_stands_there_that_may_be_no_hand_it_is_looked_for_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    desk = Desk(750.0)
    desk.play(2, BOOK)
    desk.pipeline.settle()
    looks = Looks(monkeypatch)
    desk.play(1, BOOK)
    assert looks.count == 1


def test_what_was_left_to_do_is_dropped_when_touches_end(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(750.0)
    desk.play(2)
    looks = Looks(monkeypatch)
    desk.pipeline.stall(0)
    desk.pipeline.settle()
    assert looks.count == 0
    assert desk.wrong is TRUE_READING
