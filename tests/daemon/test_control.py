"""The commands that talk to a running daemon, through a real socket."""

import itertools
import json
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.align.hold import Phase
from touchd.align.session import AlignProgress
from touchd.contacts.aim import EyeOffsets
from touchd.control.client import fetch_status, request
from touchd.control.commands import Line, Terminal, align, align_lines, calibrate, check_daemon, status_page
from touchd.control.errors import NotRunning, Refused
from touchd.control.protocol import Progress
from touchd.errors import ExitCode
from touchd.model import State

from clients.harness import PATIENCE_S
from daemon.fake_daemon import (
    ALIGNED,
    DONE,
    STATUS,
    FakeControls,
    answers,
    wait_until,
)


def test_the_status_comes_through_the_socket_in_every_form(path: Path) -> None:
    assert fetch_status(path) == STATUS
    assert status_page(path, "people").startswith("state     tracking for 1 min 30 s\n")
    assert json.loads(status_page(path, "json")) == STATUS.as_json()
    assert "\ntouchd_frames_total 2700\n" in status_page(path, "prometheus")
    assert check_daemon(lambda: path) == (0, "ok: tracking at 30.0 frames/s, 0 touches")


def test_a_daemon_that_is_not_there_is_critical_and_exit_code_69(folder: Path) -> None:
    gone = folder / "control.sock"
    sentence = f"no touchd is running here (no socket at {gone}); start it with touchd run"
    with pytest.raises(NotRunning) as caught:
        fetch_status(gone)
    assert (str(caught.value), caught.value.exit_code) == (sentence, 69)
    assert check_daemon(lambda: gone) == (2, f"critical: {sentence}")


def test_calibrating_tells_how_far_it_is_and_ends_with_what_came_out(path: Path, controls: FakeControls) -> None:
    controls.calibration = [
        Progress(State.TRACKING, None),
        Progress(State.CALIBRATING, "frame 1 of 2"),
        Progress(State.CALIBRATING, "frame 2 of 2"),
        DONE,
    ]
    assert list(calibrate(path)) == [
        Line("about to calibrate"),
        Line("calibrating: frame 1 of 2"),
        Line("calibrating: frame 2 of 2"),
        Line("calibrated: flat to 1.0 mm", lasting=True),
    ]


def test_a_calibration_that_gave_up_ends_with_the_daemon_s_reason_and_exit_code_75(
    path: Path, controls: FakeControls
) -> None:
    controls.calibration = [Progress(State.TRACKING, "something moved for 60 s", done=True, exit_code=75)]
    with pytest.raises(Refused) as caught:
        list(calibrate(path))
    assert (str(caught.value), caught.value.exit_code) == ("something moved for 60 s", ExitCode.TRY_AGAIN)


def test_a_reload_that_is_refused_comes_with_the_errors_and_exit_code_78(path: Path) -> None:
    with pytest.raises(Refused) as caught:
        list(request(path, "reload"))
    assert (str(caught.value), caught.value.exit_code) == ("touchd.yaml:1:1: tracking is wrong", 78)


def test_only_one_at_a_time_may_calibrate_or_align(path: Path, controls: FakeControls) -> None:
    first = request(path, "calibrate")
    next(first)
    for command in ("calibrate", "align"):
        with pytest.raises(Refused) as caught:
            list(request(path, command))
        assert caught.value.exit_code == 75
        assert str(caught.value).startswith("touchd is calibrating or being aligned for somebody else; try again")
    assert fetch_status(path) == STATUS
    first.close()
    assert controls.closed.wait(PATIENCE_S)


def test_the_user_is_led_from_point_to_point_and_hears_what_came_out(path: Path, controls: FakeControls) -> None:
    def at(point: int, phase: Phase, share: float = 0.0, why: str | None = None) -> AlignProgress:
        return AlignProgress(point, 4, "top-left corner" if point == 1 else "top-right corner", phase, share, why)

    controls.alignment = [
        at(1, Phase.TOUCH),
        at(1, Phase.TOUCH, why="2 touches are seen: use one finger"),
        at(1, Phase.HOLD, 0.5),
        at(1, Phase.LIFT, 1.0),
        at(1, Phase.LIFT, 1.0),
        at(2, Phase.LIFT, 1.0, why="that was the top-left corner again"),
        replace(ALIGNED, residual_mm=6.0),
    ]
    first, *lines = align_lines(path, 4)
    assert first.text.startswith("You will be asked to touch 4 points of the area")
    assert lines == [
        Line("[1/4] top-left corner: touch it and hold"),
        Line("[1/4] top-left corner: touch it and hold (2 touches are seen: use one finger)"),
        Line("[1/4] top-left corner: hold still, 50%"),
        Line("[1/4] top-left corner: got it, lift your finger", lasting=True),
        Line("[2/4] top-right corner: lift your finger (that was the top-left corner again)"),
        Line(
            "aligned and in force: 800 x 600 mm, residual 6.0 mm; kept in /var/lib/touchd/alignment.json", lasting=True
        ),
        Line(
            "A residual over 5 mm is much: were the points touched exactly, and is the area a rectangle? Run touchd "
            "align again to be sure.",
            lasting=True,
        ),
    ]


def test_from_two_sides_the_user_is_told_to_go_round_and_hears_how_far_ahead_people_aim(
    path: Path, controls: FakeControls
) -> None:
    controls.alignment = [replace(ALIGNED, residual_mm=1.0, eye=EyeOffsets(3.04, 2.0, 2.5, 2.5))]
    first, *lines = align_lines(path, 4, 2)
    assert "Then go to another side of the table, best the opposite one, and touch them again." in first.text
    assert lines[1].text == (
        "people aim ahead of their touch by 3.0 mm from the bottom, 2.0 mm from the top, 2.5 mm from the left, 2.5 mm "
        "from the right; touches are told so much farther along the finger"
    )


def test_ctrl_c_ends_an_alignment_at_both_ends(path: Path, controls: FakeControls) -> None:
    written: list[str] = []

    def write(text: str) -> None:
        written.append(text)
        if "touch it and hold" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        align(path, 9, 1, Terminal(write, redraws=True, columns=80, now_s=lambda: 0.0))
    assert written[-1] == "alignment ended: the area stays as it was\n"
    assert controls.closed.wait(PATIENCE_S)
    wait_until(lambda: answers(path))


def test_a_terminal_redraws_one_line_and_leaves_what_lasts() -> None:
    written: list[str] = []
    Terminal(written.append, redraws=True, columns=10, now_s=lambda: 0.0).show(
        [Line("0123456789abc"), Line("0123456789abc", lasting=True)]
    )
    assert written == ["\r\x1b[K012345678", "\r\x1b[K0123456789abc\n", "\r\x1b[K"]


def test_without_a_terminal_progress_is_a_line_a_second() -> None:
    written: list[str] = []
    clock = itertools.count(0.0, 0.4)
    lines = [Line(f"frame {number}") for number in range(10)] + [Line("done", lasting=True), Line("done")]
    Terminal(written.append, redraws=False, columns=80, now_s=lambda: next(clock)).show(lines)
    assert written[-1] == "done\n"
    assert 2 <= len(written) <= 6
    assert written[0] == "frame 0\n"
