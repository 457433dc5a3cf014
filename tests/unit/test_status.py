import json
import math
from dataclasses import fields, replace

import pytest
from touchd.align.alignment import AreaOrigin
from touchd.contacts.aim import EyeOffsets
from touchd.errors import StateError
from touchd.metrics import MetricsSnapshot
from touchd.model import State
from touchd.status.data import (
    AreaFacts,
    Status,
    source_facts,
    status_from_json,
    surface_facts,
)
from touchd.status.recent import RecentRise
from touchd.status.text import check, duration, sentence, status_lines
from touchd.surface.living import Vitals
from touchd.surface.quality import SurfaceReport

from statuses import FAILING, HEALTHY, NOW_S, REFUSED, SOURCE, SURFACE, TUIO

LOSING_30_PERCENT = (
    "30.0% of its packets were lost in the last 10 s: plug it into another USB port, without a hub and away from other"
    " cameras; see whether this computer is too busy"
)


def test_people_read_the_status_of_a_healthy_daemon_at_a_glance() -> None:
    assert status_lines(HEALTHY) == [
        "state     tracking for 2 h 14 min",
        "source    kinect: A00364A04287049A",
        "          30.0 frames/s, 241 201 frames, 12 dropped, connected anew once",
        "          1.4 ms from frame to touch; 99 of 100 within 3.1 ms, all within 4.0 ms",
        "touches   2 now, 1 204 since the start",
        "surface   learned 2 h 1 min ago from A00364A04287049A",
        "          821 mm away, tilted 3°, flat to 1.1 mm, noise 0.42 mm",
        "          99.8% of the area usable; touches are looked for 4.4 to 16.2 mm above it",
        "area      from touchd align, 800 x 600 mm, residual 1.4 mm",
        "outputs   tuio to 127.0.0.1:3333: 20 314 sent",
        "config    /etc/touchd/touchd.yaml",
        "process   touchd 0.1.0, pid 812, running for 2 h 15 min, 86 MB of memory",
    ]


def test_people_see_what_is_wrong_behind_an_exclamation_mark() -> None:
    status = replace(
        HEALTHY,
        config=REFUSED,
        not_kept="the surface is not kept: /var/lib/touchd: No space left on device",
        surface=replace(SURFACE, problems=("12% of the area is blind",)),
        area=AreaFacts(AreaOrigin.GUESSED, (700.0, 500.0), None, ("area guessed: run touchd align",)),
        outputs=(TUIO, FAILING),
    )
    text = "\n".join(status_lines(status))
    for expected in (
        "          ! 12% of the area is blind\n",
        "area      guessed, 700 x 500 mm\n          ! area guessed: run touchd align\n",
        "outputs   tuio to 127.0.0.1:3333: 20 314 sent\n"
        "          tuio to a:3333, b:3333: 100 sent, 7 failed\n"
        "          ! 7 not sent in the last minute\n"
        "            b:3333: 7 failed; last error: Cannot send to b:3333: Network is unreachable.\n",
        "          ! the last edit was refused 3 min 5 s ago; the config from before it is in force:\n"
        "            touchd.yaml:1:2: tracking is wrong\n              here\n              ^\n",
        "          ! the surface is not kept: /var/lib/touchd: No space left on device",
    ):
        assert expected in text


def test_before_the_first_frame_people_see_what_is_waited_for() -> None:
    waiting = replace(SOURCE, waiting="no camera is connected", fps=None, latency_p50_ms=None, frames=0)
    status = replace(HEALTHY, state=None, state_since_s=NOW_S - 75, source=waiting, surface=None, area=None)
    lines = status_lines(status)
    assert lines[0] == "state     ! no frame yet, 1 min 15 s after the start: no camera is connected"
    assert "          no frames now, 0 frames, 12 dropped, connected anew once" in lines
    assert "surface   none yet" in lines
    assert "area      known once there is a surface" in lines


@pytest.mark.parametrize(
    ("packet_loss", "expected"),
    [
        (None, []),
        (0.0, []),
        (0.001, []),
        (0.0014, ["          0.1% of its packets were lost in the last 10 s"]),
        (0.02, ["          2.0% of its packets were lost in the last 10 s"]),
        (0.3, [f"          ! {LOSING_30_PERCENT}"]),
    ],
)
def test_people_see_lost_packets_and_what_to_do_about_many(packet_loss: float | None, expected: list[str]) -> None:
    lines = status_lines(replace(HEALTHY, source=replace(SOURCE, packet_loss=packet_loss)))
    assert [line for line in lines if "lost" in line] == expected
    assert [line for line in lines if "lost" not in line] == status_lines(HEALTHY)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({}, "tracking at 30.0 frames/s, 2 touches"),
        ({"cursors": 1}, "tracking at 30.0 frames/s, 1 touch"),
        ({"state": State.CALIBRATING, "why": "frame 12 of 300"}, "calibrating: frame 12 of 300"),
        ({"state": State.NO_SURFACE, "why": "no surface\nwas learned"}, "no surface: no surface was learned"),
        ({"state": State.NO_FRAMES, "state_since_s": NOW_S - 12}, "no frames for 12 s"),
        ({"config": REFUSED}, "tracking at 30.0 frames/s, 2 touches; the config's last edit was refused"),
        ({"outputs": (TUIO, FAILING)}, "tracking at 30.0 frames/s, 2 touches; an output fails"),
        (
            {"area": AreaFacts(AreaOrigin.GUESSED, None, None, ("area guessed: run touchd align",))},
            "tracking at 30.0 frames/s, 2 touches; area guessed: run touchd align",
        ),
    ],
)
def test_one_sentence_says_what_it_is_doing(change: dict[str, object], expected: str) -> None:
    assert sentence(replace(HEALTHY, **change)) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "verdict", "expected"),
    [
        ({}, 0, "ok: tracking at 30.0 frames/s, 2 touches"),
        ({"state": State.CALIBRATING, "state_since_s": NOW_S - 9, "why": "frame 270 of 300"}, 0, "ok: calibrating"),
        ({"area": AreaFacts(AreaOrigin.GUESSED, None, None, ("area guessed",))}, 0, "ok: tracking"),
        (
            {"state": State.CALIBRATING, "state_since_s": NOW_S - 90, "why": "something moved"},
            1,
            "warning: calibrating for 1 min 30 s: something moved",
        ),
        ({"state": State.PAUSED, "why": "aligning"}, 1, "warning: paused: aligning"),
        (
            {"config": REFUSED},
            1,
            "warning: the config's last edit was refused, and the config from before it is in force",
        ),
        ({"not_kept": "the disk is full"}, 1, "warning: the disk is full"),
        (
            {"outputs": (TUIO, FAILING)},
            1,
            "warning: tuio to a:3333, b:3333: 7 not sent in the last minute: Cannot send to b:3333: Network is",
        ),
        ({"surface": replace(SURFACE, problems=("12% of the area is blind",))}, 1, "warning: 12% of the area is"),
        ({"area": AreaFacts(AreaOrigin.CONFIG, None, None, ("wrong size",))}, 1, "warning: wrong size"),
        ({"source": replace(SOURCE, dropped_lately=36)}, 0, "ok"),
        (
            {"source": replace(SOURCE, dropped_lately=40)},
            1,
            "warning: 40 frames were dropped in the last minute: this machine is too slow or too busy",
        ),
        ({"source": replace(SOURCE, packet_loss=0.02)}, 0, "ok"),
        ({"source": replace(SOURCE, packet_loss=0.3)}, 1, f"warning: A00364A04287049A: {LOSING_30_PERCENT}"),
        ({"state": State.NO_SURFACE, "why": "calibrate"}, 2, "critical: no surface: calibrate"),
        ({"state": State.NO_FRAMES, "why": "gone", "state_since_s": NOW_S - 3}, 2, "critical: no frames for 3 s: gone"),
        ({"state": None}, 2, "critical: no frames for 2 h 15 min"),
        ({"state": State.NO_SURFACE, "not_kept": "full"}, 2, "critical: no surface; full"),
    ],
)
def test_the_verdict_for_monitoring_says_why(change: dict[str, object], verdict: int, expected: str) -> None:
    found, text = check(replace(HEALTHY, **change))  # type: ignore[arg-type]
    assert found == verdict
    assert text.startswith(expected)
    assert "\n" not in text


@pytest.mark.parametrize("origin", AreaOrigin)
def test_people_read_where_the_area_comes_from_in_words(origin: AreaOrigin) -> None:
    lines = status_lines(replace(HEALTHY, area=AreaFacts(origin, None, None)))
    (line,) = (line for line in lines if line.startswith("area "))
    assert line.split()[1] in ("from", "guessed", "the")


def test_where_people_aim_is_told_with_the_area() -> None:
    area = AreaFacts(AreaOrigin.ALIGNMENT, (800.4, 599.6), 1.4, (), EyeOffsets(3.04, 2.0, 2.5, -1.0))
    lines = status_lines(replace(HEALTHY, area=area))
    at = lines.index("area      from touchd align, 800 x 600 mm, residual 1.4 mm")
    assert lines[at + 1].strip() == (
        "told ahead along the finger: 3.0 mm from the bottom, 2.0 from the top, 2.5 from the left, -1.0 from the right"
    )
    status = replace(HEALTHY, area=area)
    assert status_from_json(status.as_json()) == status


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(-3, "0 s"), (59.4, "59 s"), (59.6, "1 min 0 s"), (3599, "59 min 59 s"), (3660, "1 h 1 min"), (90000, "1 d 1 h")],
)
def test_durations_have_two_units_at_most(seconds: float, text: str) -> None:
    assert duration(seconds) == text


@pytest.mark.parametrize(
    "status",
    [
        HEALTHY,
        replace(HEALTHY, config=REFUSED, outputs=(TUIO, FAILING), surface=None),
        replace(HEALTHY, source=replace(SOURCE, packet_loss=0.3)),
    ],
)
def test_a_status_comes_back_whole_through_json(status: Status) -> None:
    assert status_from_json(json.loads(json.dumps(status.as_json(), allow_nan=False))) == status


def test_json_has_nothing_that_json_has_no_word_for() -> None:
    status = replace(
        HEALTHY,
        source=replace(SOURCE, fps=math.nan, latency_max_ms=math.inf, name="/table\udcff"),
        surface=replace(SURFACE, tilt_deg=math.nan),
    )
    plain = json.loads(json.dumps(status.as_json(), allow_nan=False))
    assert (plain["source"]["fps"], plain["source"]["latency_max_ms"], plain["surface"]["tilt_deg"]) == (None,) * 3
    assert status_from_json(plain).source.name == "/table\\udcff"


def test_json_has_these_keys_and_words() -> None:
    plain = HEALTHY.as_json()
    assert set(plain) == {field.name for field in fields(Status)} | {"uptime_s"}
    assert (plain["state"], plain["area"]["origin"], plain["uptime_s"]) == ("tracking", "alignment", 8100.0)
    assert set(plain["source"]) == {
        *("name", "kind", "waiting", "reconnects", "frames", "fps", "dropped", "dropped_lately"),
        *("latency_p50_ms", "latency_p99_ms", "latency_max_ms", "packet_loss"),
    }


def test_what_a_newer_daemon_adds_is_left_out_and_what_an_older_one_lacks_is_named() -> None:
    plain = HEALTHY.as_json()
    assert status_from_json({**plain, "mood": "good"}) == HEALTHY
    del plain["source"]["frames"]
    with pytest.raises(StateError) as caught:
        status_from_json(plain)
    assert str(caught.value) == (
        "the status is not one that this touchd understands (source.frames: Field required); is the daemon of another "
        "version? restart it"
    )


def test_the_status_of_a_daemon_that_did_not_tell_its_packet_loss_yet_is_understood() -> None:
    plain = replace(HEALTHY, source=replace(SOURCE, packet_loss=0.3)).as_json()
    assert plain["source"].pop("packet_loss") == 0.3
    assert status_from_json(plain) == HEALTHY


def test_figures_that_the_surface_report_could_not_measure_are_none() -> None:
    nan = math.nan
    report = SurfaceReport(0.0, nan, nan, nan, nan, nan, nan, 0.0, ("no pixel of the area can see a touch",))
    facts = surface_facts(report, "a camera", None, Vitals(nan, 0))
    assert (facts.coverage, facts.noise_mm, facts.distance_mm, facts.moved) == (0.0, None, None, 0.0)
    lines = status_lines(replace(HEALTHY, surface=facts))
    assert "          ? mm away, tilted ?°, flat to ? mm, noise ? mm" in lines
    assert "surface   learned from a camera" in lines


def test_people_see_how_a_surface_has_fared_since_it_was_learned() -> None:
    lived = replace(SURFACE, drift_mm=2.34, moves=2)
    assert "          drifted by 2.3 mm since then, which is followed; moved twice and learned again" in status_lines(
        replace(HEALTHY, surface=lived)
    )
    assert "          drifted by 0.0 mm since then, which is followed" in status_lines(
        replace(HEALTHY, surface=replace(SURFACE, drift_mm=0.01))
    )
    assert not [line for line in status_lines(HEALTHY) if "drift" in line]


def test_people_see_that_touch_is_paused_and_why() -> None:
    why = "the camera or the table was moved"
    paused = replace(HEALTHY, state=State.PAUSED, state_since_s=NOW_S - 3, why=why)
    assert status_lines(paused)[0] == f"state     ! paused for 3 s: {why}"
    assert check(paused) == (1, f"warning: paused: {why}")


def test_a_source_s_facts_are_its_metrics() -> None:
    metrics = MetricsSnapshot(241201, 12, 29.97, 1.42, 3.1, 4.04)
    assert source_facts("A00364A04287049A", "kinect", None, 1, metrics, 0, None) == SOURCE
    assert source_facts("A00364A04287049A", "kinect", None, 1, metrics, 0, 0.3) == replace(SOURCE, packet_loss=0.3)


def test_only_what_rose_in_the_last_minute_counts_as_recent() -> None:
    recent = RecentRise(window_s=60.0, samples=60)
    assert recent.note("failed", 0, 1000.0) == 0
    assert recent.note("failed", 5, 1001.0) == 5
    assert recent.note("other", 0, 1001.0) == 0
    assert [recent.note("failed", 5, 1000.0 + after) for after in (30, 59, 60)] == [5, 5, 5]
    assert recent.note("failed", 5, 1061.0) == 0
    assert recent.note("failed", 6, 1061.1) == 1


def test_a_counter_that_began_anew_counts_from_zero() -> None:
    recent = RecentRise()
    recent.note("failed", 0, 0.0)
    recent.note("failed", 50, 1.0)
    assert recent.note("failed", 2, 2.0) == 2
