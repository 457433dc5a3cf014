"""Things become part of the surface, and are given back when they are taken away."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from touchd.geometry import KINECT_INVALID
from touchd.model import Frame
from touchd.table.scene import Block, Capsule, Hand

from living_tables import AT_MM, Desk, cursor_counts, finger, learned, off_raw
from shifting_table import uneven

X, Y = AT_MM
THINGS: dict[str, tuple[Block | Capsule, float]] = {
    "phone": (Block((X, Y, 0.0), (146.0, 71.0, 8.0), 30.0), 8.0),
    "cup": (Capsule((X, Y, 38.0), (X, Y, 62.0), 38.0, 38.0), 100.0),
    "book": (Block((X, Y, 0.0), (148.0, 205.0, 30.0), 20.0), 30.0),
}


def thing(name: str) -> Hand:
    return Hand((THINGS[name][0],), ())


def joined(desk: Desk, *things: Hand, among: Sequence[Hand] = ()) -> None:
    """Let things lie, and become part of the surface."""
    desk.play(3, *among, *things)
    desk.living.join(desk.mask_of(*things))
    # Until it has joined, whether it touches is for others to tell.
    assert sum(cursor_counts(desk.play(24, *among, *things)[20:])) == 0


@pytest.mark.parametrize("height_mm", [750.0, 1500.0])
@pytest.mark.parametrize(
    ("name", "method"),
    [("phone", "fingertip"), ("book", "fingertip"), ("phone", "shell"), ("cup", "shell"), ("book", "shell")],
)
def test_a_thing_that_became_part_of_the_surface_can_be_touched_and_leaves_no_ghost(
    name: str, height_mm: float, method: str
) -> None:
    desk = Desk(height_mm, method)
    joined(desk, thing(name))
    part, mask = desk.living.part_of_surface, desk.mask_of(thing(name))
    assert np.count_nonzero(part & mask) > 0.8 * np.count_nonzero(mask)
    top_mm = THINGS[name][1]
    touching = cursor_counts(desk.play(8, thing(name), finger(top_mm)))
    assert (max(touching), sum(touching) >= 6) == (1, True)
    assert cursor_counts(desk.play(4, thing(name)))[-1] == 0
    taken = desk.play(30)
    assert sum(cursor_counts(taken[2:])) == 0
    assert not desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.05
    assert cursor_counts(desk.play(4, finger()))[-2:] == [1, 1]


def test_before_it_joins_a_thing_is_looked_at_while_it_keeps_still() -> None:
    desk = Desk(750.0, "shell")
    desk.living.join(desk.mask_of(thing("book")))
    for step in range(20):
        desk.play(1, Hand((Block((X + 4.0 * step, Y, 0.0), (148.0, 205.0, 30.0 + 2.0 * step), 20.0),), ()))
    assert not desk.living.part_of_surface.any()
    desk.play(50, thing("book"))
    assert desk.living.part_of_surface.any()


def test_the_surface_drifts_on_under_a_thing() -> None:
    desk = Desk(750.0, "shell", frame_ns=100_000_000)
    joined(desk, thing("book"))
    for step in range(60):
        desk.shift(uneven(0.02 * step))
        desk.play(1, thing("book"))
    assert sum(cursor_counts(desk.play(30)[2:])) == 0
    under = desk.mask_of(thing("book"))
    assert np.abs(off_raw(desk, uneven(1.18)))[under].max() < 0.3


def test_a_thing_on_a_thing_is_taken_off_and_both_at_once_are_taken_away() -> None:
    desk = Desk(750.0, "shell")
    on_it = Hand((Block((X, Y, 30.0), (90.0, 60.0, 20.0), 20.0),), ())
    joined(desk, thing("book"))
    joined(desk, on_it, among=[thing("book")])
    desk.play(15, thing("book"))
    book = np.count_nonzero(desk.living.part_of_surface)
    assert cursor_counts(desk.play(4, thing("book"), finger(30.0)))[-1] == 1
    joined(desk, on_it, among=[thing("book")])
    assert np.count_nonzero(desk.living.part_of_surface) >= book
    assert sum(cursor_counts(desk.play(30)[2:])) == 0
    assert not desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0)).mean() < 0.05


def test_where_a_thing_was_pushed_off_the_surface_from_before_is_back() -> None:
    desk = Desk(750.0, "shell")
    joined(desk, thing("book"))
    pushed = Hand((Block((X - 80.0, Y, 0.0), (148.0, 205.0, 30.0), 20.0),), ())
    desk.play(25, pushed)
    left_free = desk.mask_of(thing("book")) & ~desk.mask_of(pushed)
    back = np.abs(off_raw(desk, 0.0))[left_free] < 0.5
    assert np.mean(back) > 0.85


def test_what_was_pushed_is_no_part_of_the_surface_any_more_and_leaves_nothing_behind() -> None:
    desk = Desk(750.0, "shell")
    joined(desk, thing("book"))
    pushed = Hand((Block((X - 80.0, Y, 0.0), (148.0, 205.0, 30.0), 20.0),), ())
    desk.play(30, pushed)
    assert not desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0))[~desk.mask_of(pushed)].max() < 1.0


def test_a_hand_over_a_thing_does_not_take_it_away() -> None:
    desk = Desk(750.0, "shell")
    joined(desk, thing("phone"))
    before = np.count_nonzero(desk.living.part_of_surface)
    desk.play(25, thing("phone"), finger(40.0))
    assert np.count_nonzero(desk.living.part_of_surface) == before


def test_a_hand_that_comes_close_to_a_thing_is_not_learned_with_it() -> None:
    desk = Desk(750.0, "shell")
    desk.play(3, thing("phone"))
    desk.living.join(desk.mask_of(thing("phone")))
    desk.play(5, thing("phone"))
    for step in range(-9, 10):
        desk.play(1, thing("phone"), finger(5.0, (X + 10.0 * step, Y + 62.0)))
    assert not desk.living.part_of_surface.any()
    desk.play(12, thing("phone"))
    assert desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0))[~desk.mask_of(thing("phone"))].max() < 9.0
    assert sum(cursor_counts(desk.play(5, thing("phone")))) == 0


def test_a_thing_is_learned_soon_after_a_hand_that_was_there_when_it_was_first_looked_at_has_left() -> None:
    desk = Desk(750.0, "shell")
    beside = finger(0.0, (X + 20.0, Y + 50.0))
    desk.play(3, thing("phone"), beside)
    desk.living.join(desk.mask_of(thing("phone")))
    desk.play(5, thing("phone"), beside)
    desk.play(21, thing("phone"))
    assert desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0))[~desk.mask_of(thing("phone"))].max() < 9.0


def test_how_a_thing_reads_otherwise_later_is_taken_away_with_it() -> None:
    desk = Desk(750.0, "shell")
    joined(desk, thing("book"))
    swollen = Hand((Block((X, Y, 0.0), (148.0, 205.0, 30.9), 20.0),), ())
    desk.living.join(desk.mask_of(swollen))
    desk.play(24, swollen)
    mask = desk.mask_of(swollen)
    assert np.mean(np.abs(off_raw(desk, 0.0))[mask]) > 5.0
    desk.play(6)
    assert not desk.living.part_of_surface.any()
    assert np.abs(off_raw(desk, 0.0))[mask].mean() < 0.2


def test_what_cannot_be_read_of_a_thing_is_as_high_as_what_surrounds_it() -> None:
    desk = Desk(750.0, "shell")
    mask = desk.mask_of(thing("book"))
    rows, columns = (int(np.mean(axis)) for axis in np.nonzero(mask))
    blind = np.s_[rows - 5 : rows + 5, columns - 5 : columns + 5]
    desk.living.join(mask)
    for _ in range(20):
        frame = desk.frame([thing("book")])
        raw = frame.raw.copy()
        raw[blind] = KINECT_INVALID
        desk.pipeline.step(Frame(frame.index, frame.t_ns, raw))
    seen = desk.living.whole().reference
    around = seen[rows - 12 : rows + 12, columns - 12 : columns + 12]
    assert seen[blind] == pytest.approx(np.median(around), abs=3.0)


def test_what_lay_there_while_the_surface_was_learned_can_be_taken_away_too() -> None:
    desk = Desk(750.0, "shell", frame_ns=100_000_000)
    surface = learned(750.0)[1]
    high_raw = np.where(desk.mask_of(thing("book")), np.float32(18.0), np.float32(0.0))
    with_book = replace(
        surface, reference=surface.reference - high_raw, dmax=(surface.dmax - high_raw).astype(np.uint16)
    )
    desk.pipeline.use(with_book)
    assert sum(cursor_counts(desk.play(30))) == 0
    assert sum(cursor_counts(desk.play(40))) == 0
    assert np.mean(np.abs(off_raw(desk, 0.0))[high_raw > 0.0] < 0.5) > 0.95
    assert cursor_counts(desk.play(3, finger()))[-1] == 1


def test_a_sheet_of_paper_becomes_the_surface_for_good() -> None:
    desk = Desk(1500.0, "shell")
    sheet = Hand((Block((X, Y, 0.0), (297.0, 210.0, 1.0), 10.0),), ())
    joined(desk, sheet)
    assert not desk.living.part_of_surface.any()
    assert sum(cursor_counts(desk.play(5))) == 0
