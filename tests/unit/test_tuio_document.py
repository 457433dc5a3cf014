"""What docs/tuio.md shows of the wire and of the config is what touchd does."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.model import Cursor, Hover, State, TouchFrame
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.profiles import BLOB_2D, CURSOR_25D, Profile, wire_values
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.things import AirCursor, Blob, Thing
from touchd.outputs.tuio import TuioEncoder
from touchd.tracking.settings import TrackingSettings

TEXT = (Path(__file__).parents[2] / "docs" / "tuio.md").read_text(encoding="utf-8")
DUMP_LINE = re.compile(r"^([0-9a-f]{4})  ((?:[0-9a-f]{2} )*[0-9a-f]{2})  ", re.MULTILINE)
DUMPS = [block for block in TEXT.split("```") if DUMP_LINE.search(block)]
ORIENTATION = re.compile(r"^\| (true|false) \| (true|false) \| (true|false) \| ([a-z ]+) \| ([a-z ]+) \|", re.MULTILINE)
CORNERS = {"top left": (0.0, 0.0), "top right": (1.0, 0.0), "bottom left": (0.0, 1.0), "bottom right": (1.0, 1.0)}


def cursor(session_id: int, x: float, y: float) -> Cursor:
    return Cursor(session_id, x, y, vx=0.5, vy=-0.125, accel=0.0, height_mm=4.0, area_mm2=60.0, angle=0.1)


def crowd(count: int) -> list[Cursor]:
    return [cursor(session_id, 0.25, 0.75) for session_id in range(1, count + 1)]


def dumped(block: str) -> bytes:
    return bytes.fromhex("".join(line[2] for line in DUMP_LINE.finditer(block)))


def test_the_dump_is_the_bundle_that_the_encoder_makes() -> None:
    encoder = TuioEncoder("touchd-table-main@127.0.0.1", session_offset=6, first_fseq=1000)
    (datagram,) = encoder.next_frame([cursor(1, 0.25, 0.75)]).split(4096)
    assert dumped(DUMPS[0]) == datagram


def test_the_dump_of_a_fingertip_is_the_set_that_is_sent_of_it() -> None:
    hover = Hover(1, 0.25, 0.75, 20.0, vx=0.5, vy=-0.125, vz_mm_s=-100.0)
    (told,) = Fingertips(Screen(), TrackingSettings().hover_mm).of(TouchFrame(0, 0, State.TRACKING, hovers=(hover,)))
    assert dumped(DUMPS[1]) == CURSOR_25D.set(7, wire_values(told) or ())


def test_the_dump_of_a_thing_is_the_set_that_is_sent_of_it() -> None:
    share = 150.0 * 75.0 / (800.0 * 600.0)
    told = Blob(1, 0.25, 0.75, 0.5, 150.0 / 800.0, 75.0 / 600.0, share, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert dumped(DUMPS[2]) == BLOB_2D.set(7, wire_values(told) or ())


@pytest.mark.parametrize("block", DUMPS, ids=["2Dcur", "25Dcur", "2Dblb"])
def test_each_line_of_a_dump_begins_at_the_offset_it_says(block: str) -> None:
    offset = 0
    for line in DUMP_LINE.finditer(block):
        assert int(line[1], 16) == offset
        offset += len(bytes.fromhex(line[2]))


def most_in_one(thing: Thing, profile: Profile, max_bytes: int) -> int:
    """Return how many of a thing one datagram holds."""
    name = "touchd-table-main@192.168.0.2"
    return max(
        count
        for count in range(1, 61)
        if len(
            TuioEncoder(name, 0, 1, profile)
            .next_frame([replace(thing, session_id=number) for number in range(1, count + 1)])
            .split(max_bytes)
        )
        == 1
    )


def test_one_datagram_holds_as_many_fingertips_and_things_as_the_page_says() -> None:
    tip = AirCursor(1, 0.5, 0.5, 0.5, 0.0, 0.0, 0.0, 0.0)
    thing = Blob(1, 0.5, 0.5, 0.0, 0.1, 0.1, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0)
    far, near = ((most_in_one(tip, CURSOR_25D, limit), most_in_one(thing, BLOB_2D, limit)) for limit in (1472, 4096))
    assert f"holds {far[0]} fingertips or {far[1]} things" in TEXT
    assert f"one on the loopback {near[0]} or {near[1]};" in TEXT


def test_the_sizes_are_those_of_a_source_name_of_29_characters() -> None:
    name = "touchd-table-main@192.168.0.2"
    assert len(name) == 29
    encoder = TuioEncoder(name, session_offset=0, first_fseq=1)
    sizes = [len(encoder.next_frame(crowd(count)).split(4096)[0]) for count in (0, 10, 60)]
    assert "A bundle without cursors has {} bytes".format(*sizes) in TEXT
    assert "10 cursors {1}, with 60\ncursors {2}.".format(*sizes) in TEXT


def test_one_datagram_to_another_computer_holds_as_many_cursors_as_the_page_says() -> None:
    most = max(
        count
        for count in range(1, 61)
        if len(TuioEncoder("touchd-table-main@192.168.0.2", 0, 1).next_frame(crowd(count)).split(1472)) == 1
    )
    assert f"{most} cursors in one datagram with that name" in TEXT


def test_the_page_names_all_eight_orientations_once() -> None:
    assert len({row.groups()[:3] for row in ORIENTATION.finditer(TEXT)}) == 8


@pytest.mark.parametrize("row", ORIENTATION.findall(TEXT), ids=" ".join)
def test_an_orientation_takes_the_corners_where_the_page_says(row: tuple[str, str, str, str, str]) -> None:
    swap_axes, flip_x, flip_y = (word == "true" for word in row[:3])
    placement = ScreenMap(swap_axes=swap_axes, flip_x=flip_x, flip_y=flip_y)
    for corner, becomes in (("top left", row[3]), ("top right", row[4])):
        placed = placement.place(cursor(1, *CORNERS[corner]))
        assert (placed.x, placed.y) == CORNERS[becomes]


def test_every_example_that_the_page_links_to_is_there() -> None:
    linked = re.findall(r"\]\((examples/[^)]+)\)", TEXT)
    assert linked
    assert all((Path(__file__).parents[2] / "docs" / name).is_file() for name in linked)
