"""What docs/tuio.md shows of the wire and of the config is what touchd does."""

import re
from pathlib import Path

import pytest
from touchd.model import Cursor
from touchd.outputs.screen import ScreenMap
from touchd.outputs.tuio import TuioEncoder

TEXT = (Path(__file__).parents[2] / "docs" / "tuio.md").read_text(encoding="utf-8")
DUMP_LINE = re.compile(r"^([0-9a-f]{4})  ((?:[0-9a-f]{2} )*[0-9a-f]{2})  ", re.MULTILINE)
ORIENTATION = re.compile(r"^\| (true|false) \| (true|false) \| (true|false) \| ([a-z ]+) \| ([a-z ]+) \|", re.MULTILINE)
CORNERS = {"top left": (0.0, 0.0), "top right": (1.0, 0.0), "bottom left": (0.0, 1.0), "bottom right": (1.0, 1.0)}


def cursor(session_id: int, x: float, y: float) -> Cursor:
    return Cursor(session_id, x, y, vx=0.5, vy=-0.125, accel=0.0, height_mm=4.0, area_mm2=60.0, angle=0.1)


def crowd(count: int) -> list[Cursor]:
    return [cursor(session_id, 0.25, 0.75) for session_id in range(1, count + 1)]


def test_the_dump_is_the_bundle_that_the_encoder_makes() -> None:
    encoder = TuioEncoder("touchd-table-main@127.0.0.1", session_offset=6, first_fseq=1000)
    (datagram,) = encoder.next_frame([cursor(1, 0.25, 0.75)]).split(4096)
    assert bytes.fromhex("".join(line[2] for line in DUMP_LINE.finditer(TEXT))) == datagram


def test_each_line_of_the_dump_begins_at_the_offset_it_says() -> None:
    offset = 0
    for line in DUMP_LINE.finditer(TEXT):
        assert int(line[1], 16) == offset
        offset += len(bytes.fromhex(line[2]))


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
