"""Whatever is sent to the control socket gets an answer that can be read, and does the daemon no harm."""

import json
import socket
import tempfile
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from touchd.align.hold import Phase
from touchd.align.session import AlignProgress
from touchd.control.protocol import COMMANDS, Answerer, Progress, encoded
from touchd.control.server import ControlServer, Limits
from touchd.errors import ConfigError
from touchd.model import State
from touchd.status.data import ConfigFacts, SourceFacts, Status

STATUS = Status(
    version="0.1.0",
    pid=1,
    time_s=2.0,
    started_s=1.0,
    memory_bytes=None,
    state=None,
    state_since_s=1.0,
    why=None,
    cursors=0,
    touches=0,
    config=ConfigFacts(None),
    not_kept=None,
    source=SourceFacts("a test", "synthetic", None, 0, 0, None, 0, 0, None, None, None),
    surface=None,
    area=None,
    outputs=(),
)


@dataclass
class QuickControls:
    """Does everything at once; reload fails the ways that it can."""

    reload_error: Exception | None = None
    aligned: list[int] = field(default_factory=list)

    def status(self) -> Status:
        return STATUS

    def calibrate(self) -> Generator[Progress]:
        yield Progress(State.CALIBRATING, "frame 1 of 2")
        yield Progress(State.TRACKING, None, done=True, ok=True)

    def reload(self) -> str:
        if self.reload_error is not None:
            raise self.reload_error
        return "nothing changed"

    def align(self, points: int, sides: int) -> Generator[AlignProgress]:
        self.aligned.append(points)
        yield AlignProgress(points * sides, points * sides, "centre", Phase.DONE, done=True)


def answers(line: bytes, controls: QuickControls | None = None) -> list[dict[str, Any]]:
    replies = [json.loads(encoded(reply)) for reply in Answerer(controls or QuickControls()).replies(line)]
    assert [reply["done"] for reply in replies] == [False] * (len(replies) - 1) + [True]
    return replies


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(st.binary(max_size=200))
@example(b"")
@example(b"[" * 4096)
@example(b'{"command": ' + b"1" * 4000 + b"}")
@example(b'{"command": "\\ud800"}')
@settings(deadline=None)
def test_bytes_that_are_no_request_are_refused_in_a_sentence(line: bytes) -> None:
    (reply,) = answers(line)
    assert reply["exit_code"] == 64
    assert reply["error"].startswith(("a request is one line of JSON such as", "unknown command"))


@given(st.dictionaries(st.sampled_from(["command", "points", "x"]), JSON | st.sampled_from(COMMANDS)))
@settings(deadline=None)
def test_any_object_is_carried_out_or_refused(request: dict[str, Any]) -> None:
    controls = QuickControls()
    last = answers(json.dumps(request).encode(), controls)[-1]
    assert ("error" in last) != ("result" in last or "progress" in last)
    assert set(controls.aligned) <= {4, 9}
    if request.get("command") not in COMMANDS:
        assert last["error"].endswith("the commands are status, calibrate, reload, align")
        assert len(last["error"]) < 120


@given(st.sampled_from([True, None, 4.0, "4", 5, [4], float("nan")]))
@settings(deadline=None)
def test_points_other_than_4_and_9_are_refused(points: object) -> None:
    (reply,) = answers(json.dumps({"command": "align", "points": points}).encode())
    assert reply == {"error": f'"points" is 4 or 9, found {points!r}', "exit_code": 64, "done": True}


@given(st.sampled_from([True, None, 2.0, "2", 0, 3, [1]]))
@settings(deadline=None)
def test_sides_other_than_1_and_2_are_refused(sides: object) -> None:
    (reply,) = answers(json.dumps({"command": "align", "points": 4, "sides": sides}).encode())
    assert reply == {"error": f'"sides" is 1 or 2, found {sides!r}', "exit_code": 64, "done": True}


def test_an_alignment_from_two_sides_has_twice_the_points() -> None:
    (reply,) = answers(b'{"command": "align", "points": 4, "sides": 2}')
    assert reply["progress"]["points"] == 8


@given(st.text())
@settings(deadline=None)
def test_an_error_of_the_daemon_is_passed_on_with_its_exit_code(text: str) -> None:
    (reply,) = answers(b'{"command": "reload"}', QuickControls(ConfigError(text)))
    assert (reply["error"], reply["exit_code"]) == (text, 78)


def test_a_bug_in_the_daemon_is_exit_code_70_and_no_more(caplog: pytest.LogCaptureFixture) -> None:
    (reply,) = answers(b'{"command": "reload"}', QuickControls(ZeroDivisionError("secret")))
    assert reply["exit_code"] == 70
    assert "secret" not in reply["error"]
    assert "a request on the control socket failed" in caplog.text


class UntidyControls(QuickControls):
    """Fails when its calibration is closed."""

    def calibrate(self) -> Generator[Progress]:
        try:
            while True:
                yield Progress(State.CALIBRATING, None)
        finally:
            raise TimeoutError("the main thread does not answer")


def test_work_that_cannot_be_ended_well_is_logged_and_keeps_nobody_else_out(caplog: pytest.LogCaptureFixture) -> None:
    answerer = Answerer(UntidyControls())
    for _ in range(2):
        replies = answerer.replies(b'{"command": "calibrate"}')
        assert not next(replies)["done"]
        replies.close()
    assert caplog.text.count("a request on the control socket did not end well") == 2


@pytest.fixture(scope="module")
def server() -> Iterator[ControlServer]:
    with tempfile.TemporaryDirectory() as folder:
        server = ControlServer(Path(folder) / "control.sock", QuickControls(), Limits(request_s=30.0, reply_s=30.0))
        server.start()
        yield server
        server.stop()


@given(st.lists(st.binary(max_size=3000), max_size=4))
@settings(deadline=None, max_examples=200)
def test_a_real_server_survives_whatever_is_sent_to_it(server: ControlServer, parts: list[bytes]) -> None:
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(server.path))
        try:
            for part in parts:
                client.sendall(part)
            client.shutdown(socket.SHUT_WR)
        except BrokenPipeError:
            pass  # it had enough
        else:
            with client.makefile("rb") as received:
                lines = _lines(received)
            assert all(json.loads(line)["done"] for line in lines[-1:])
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(server.path))
        client.sendall(b'{"command": "status"}\n')
        with client.makefile("rb") as received:
            assert json.loads(received.readline())["result"] == STATUS.as_json()


def _lines(received: Any) -> list[bytes]:
    try:
        return list(received)
    except ConnectionResetError:
        return []  # it closed with something still unread
