import json

from touchd.errors import ExitCode
from touchd.listen.checker import Appeared, Checker, Seen
from touchd.listen.cursors import Change, CursorEvent
from touchd.listen.pace import Apart, Pace, Window
from touchd.listen.report import Ledger, LiveLines, Verdict
from touchd.listen.rules import PHANTOM, REUSED_ID, Finding
from touchd.listen.sender import Sender

from clients.bad_senders import frame

SECOND_NS = 1_000_000_000
MS_NS = 1_000_000


def finding(number: int, rule: str = "phantom", name: str = "bad@table") -> Finding:
    broken = {"phantom": PHANTOM, "reused-id": REUSED_ID}[rule]
    return Finding(broken, name, "127.0.0.1:40000", f"cursor {number} is wrong", number, number * SECOND_NS)


def verdict_of(*findings: Finding, datagrams: tuple[bytes, ...] = (), kernel_drops: int = 0) -> Verdict:
    checker, ledger = Checker(), Ledger()
    for number, datagram in enumerate(datagrams):
        checker.feed(datagram, ("127.0.0.1", 40_000), number * 20 * MS_NS)
    for each in findings:
        ledger.note(each)
    return Verdict(
        3333, 0, 10 * SECOND_NS, checker.datagrams, kernel_drops, checker.totals(), ledger.entries, columns=100
    )


def test_a_rule_is_told_once_for_each_sender_and_counted() -> None:
    ledger = Ledger()
    told = [ledger.note(each) for each in (finding(1), finding(2), finding(3, name="other@table"), finding(4))]
    assert told == [True, False, True, False]
    assert [(entry.first.name, entry.count) for entry in ledger.entries] == [("bad@table", 3), ("other@table", 1)]


def test_the_summary_has_faults_before_advice_and_says_what_to_do() -> None:
    datagrams = tuple(frame(number, {1: (number / 10, 0.5)}) for number in range(1, 5))
    verdict = verdict_of(finding(2, "reused-id"), finding(3), finding(4), datagrams=datagrams, kernel_drops=7)
    assert list(verdict.lines()) == [
        "listened for 10.0 s on UDP port 3333",
        "bad@table (127.0.0.1:40000), 2Dcur",
        "    4 frames, 20.0 ms apart in the median (p99 20.0, worst 20.0)",
        "    4 datagrams, the largest of 176 bytes",
        "    touches: 1 added, 0 removed, 1 alive at the end, at most 1 at a time",
        "the kernel dropped 7 datagrams here: this computer was too slow to check them all, which is not the",
        "sender's fault",
        "FAULT phantom, 2 times, at 3.00 s:",
        "    bad@table (127.0.0.1:40000), fseq 3: cursor 3 is wrong. Qt and python-tuio press at (0, 0). Set",
        "    a cursor in the bundle that first lists it.",
        "advice reused-id, once, at 2.00 s:",
        "    bad@table (127.0.0.1:40000), fseq 2: cursor 2 is wrong. When the removal is lost, clients draw a",
        "    line to the new place. Give each touch a new session id.",
        "1 fault and 1 advice: real clients break with this sender",
    ]
    assert verdict.exit_code == ExitCode.BAD_DATA


def test_advice_alone_is_a_success() -> None:
    verdict = verdict_of(finding(2, "reused-id"), datagrams=(frame(1),))
    assert list(verdict.lines())[-1] == "no fault and 1 advice: no client breaks"
    assert verdict.exit_code == ExitCode.OK


def test_what_the_network_did_is_information() -> None:
    verdict = verdict_of(datagrams=(frame(1), frame(2), frame(5), frame(4)))
    assert "    lost on the way: 1 frames (numbers that are missing), late: 1" in list(verdict.lines())
    assert verdict.exit_code == ExitCode.OK


def test_the_json_has_every_figure_of_a_sender() -> None:
    (sender,) = json.loads(verdict_of(datagrams=(frame(1), frame(2, {1: (0.5, 0.5)}))).as_json())["senders"]
    assert sender == {
        "name": "bad@table", "address": "127.0.0.1:40000", "profiles": ["2Dcur"], "datagrams": 2, "frames": 2,
        "adds": 1, "removes": 0, "alive": 1, "most_alive": 1, "lost": 0, "late": 0, "most_bytes": 176, "apart": None,
    }  # fmt: skip


def test_live_lines_fit_the_terminal_and_carry_the_time() -> None:
    lines = LiveLines(start_ns=SECOND_NS, moves=False, columns=80)
    assert lines.of_note(finding(3), 3 * SECOND_NS) == [
        "   2.00 FAULT  bad@table (127.0.0.1:40000), fseq 3: cursor 3 is wrong. Qt and",
        "               python-tuio press at (0, 0). Set a cursor in the bundle that",
        "               first lists it.",
    ]


def test_moves_are_told_only_where_they_are_wanted() -> None:
    seen = Seen("bad@table (127.0.0.1:40000)", CursorEvent(Change.MOVE, "cursor", 5, 0.25, 0.5))
    assert LiveLines(0, moves=False, columns=80).of_note(seen, 0) == []
    assert LiveLines(0, moves=True, columns=80).of_note(seen, 0) == ["   0.00 move   cursor 5 at 0.250, 0.500"]


def test_a_fingertip_is_told_with_its_height() -> None:
    seen = Seen("bad@table (127.0.0.1:40000)", CursorEvent(Change.ADD, "cursor", 5, 0.25, 0.5, 0.0))
    assert LiveLines(0, moves=False, columns=80).of_note(seen, 0) == ["   0.00 add    cursor 5 at 0.250, 0.500, 0.000"]


def test_with_two_senders_every_line_says_whose_it_is() -> None:
    lines = LiveLines(0, moves=False, columns=100)
    seen = Seen("one@a (127.0.0.1:1)", CursorEvent(Change.ADD, "cursor", 5, None, None))
    lines.of_note(Appeared("one@a (127.0.0.1:1)"), 0)
    assert lines.of_note(seen, 0) == ["   0.00 add    cursor 5 without a position"]
    lines.of_note(Appeared("two@b (127.0.0.1:2)"), 0)
    assert lines.of_note(seen, 0) == ["   0.00 add    one@a (127.0.0.1:1): cursor 5 without a position"]


def test_the_rate_of_a_second_is_told_in_a_line() -> None:
    window = Window(72, 36, Apart(33.3, 38.25, 87.75))
    lines = LiveLines(0, moves=False, columns=100)
    assert lines.of_window(Sender("a@b", ("127.0.0.1", 1)), window, SECOND_NS * 6 // 5, SECOND_NS) == [
        "   1.00 rate   60 bundles/s, 30 frames/s, 33.3 ms apart (p99 38.2, worst 87.8), 0 alive, ≤ 0 bytes"
    ]


def test_jitter_is_that_of_frames_with_cursors_and_leaves_out_silence() -> None:
    pace = Pace()
    t_ns = 0
    for interval_ms, live in ((0, True), (10, True), (30, True), (20, False), (900, True), (5000, True), (10, True)):
        t_ns += interval_ms * MS_NS
        pace.note_frame(t_ns, live)
    assert pace.look() == Window(0, 7, Apart(10.0, 30.0, 30.0))
    assert pace.look() == Window(0, 0, None)
    assert pace.apart() == Apart(10.0, 30.0, 30.0)


def test_percentiles_are_those_of_the_nearest_rank() -> None:
    pace = Pace()
    t_ns = 0
    pace.note_frame(t_ns, live=True)
    for interval_ms in range(1, 101):
        t_ns += interval_ms * MS_NS
        pace.note_frame(t_ns, live=True)
    assert pace.apart() == Apart(50.0, 99.0, 100.0)
