"""One recording to three ports: touches, fingertips and things, each as its own profile, and no rule broken."""

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from touchd.cli import run_command_line
from touchd.formats.libfreenect import write_libfreenect
from touchd.geometry import ZeroPlane
from touchd.listen.checker import Checker
from touchd.listen.rules import Finding

from clients.bundles import Mailbox, read_bundle
from golden.replays import load, load_frames
from golden.truth import read_events

PROFILES = ("2Dcur", "25Dcur", "2Dblb")


@pytest.fixture
def boxes() -> Iterator[dict[str, Mailbox]]:
    with Mailbox() as touches, Mailbox() as fingertips, Mailbox() as things:
        yield dict(zip(PROFILES, (touches, fingertips, things), strict=True))


@pytest.fixture
def taps(tmp_path: Path, boxes: dict[str, Mailbox]) -> list[str]:
    """Return the command that replays six taps to all boxes."""
    golden = load("taps-750")
    assert golden.zero_plane is not None
    write_libfreenect(tmp_path / "recording", load_frames("taps-750"), ZeroPlane(**golden.zero_plane))
    outputs = [{"tuio": {"to": [box.destination], "profile": name}} for name, box in boxes.items()]
    (tmp_path / "touchd.yaml").write_text(json.dumps(golden.config | {"outputs": outputs}))
    options = ["--config", tmp_path / "touchd.yaml", "--events", tmp_path / "events.jsonl", "--send"]
    return ["replay", str(tmp_path / "recording"), *map(str, options)]


def test_each_port_gets_its_profile_and_a_finger_is_one_cursor_of_25dcur(
    taps: list[str], boxes: dict[str, Mailbox], tmp_path: Path
) -> None:
    assert run_command_line(taps) == 0
    events = read_events(tmp_path / "events.jsonl")
    posts = {name: box.take() for name, box in boxes.items()}
    for name, post in posts.items():
        checker = Checker()
        notes = [n for i, sent in enumerate(post) for n in checker.feed(sent, ("127.0.0.1", 40_000), i * 33_333_333)]
        assert [note.sentence() for note in notes if isinstance(note, Finding)] == [], name
    touches = {cursor["id"] for event in events for cursor in event["cursors"]}
    heights = [{i: v[2] for i, v in read_bundle(sent, "25Dcur").sets.items()} for sent in posts["25Dcur"]]
    presses = [i for before, now in pairwise(heights) for i, z in now.items() if z == 0.0 != before.get(i)]
    assert len(presses) == len(touches) == 6
    assert len(set(presses)) < 6  # a finger that taps again from the air is the same cursor
    assert all(read_bundle(sent, "2Dblb").sets == {} for sent in posts["2Dblb"])
