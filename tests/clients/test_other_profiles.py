"""Profiles 25Dcur and 2Dblb in clients that know them: liblo's oscdump, and python-tuio for blobs."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from pythonosc.osc_server import BlockingOSCUDPServer
from pythontuio import TuioClient, TuioListener
from touchd.model import Cursor, Hover, State, TableObject, TouchFrame
from touchd.outputs.blobs import Blobs
from touchd.outputs.fingertips import Fingertips
from touchd.outputs.profiles import BLOB_2D, CURSOR_25D
from touchd.outputs.screen import Screen, ScreenMap
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender

from clients.harness import PATIENCE_S, OscDump

FRAME_NS = 33_333_333
SOURCE = "touchd-test-main@127.0.0.1"
AREA_MM = (800.0, 400.0)


class BlobLog(TuioListener):  # type: ignore[misc]  # python-tuio has no types
    """What python-tuio tells of blobs."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []
        self.changed = threading.Condition()

    def add_tuio_blob(self, blob: Any) -> None:
        self._note("add", blob)

    def update_tuio_blob(self, blob: Any) -> None:
        self._note("move", blob)

    def remove_tuio_blob(self, blob: Any) -> None:
        self._note("remove", blob)

    def _note(self, what: str, blob: Any) -> None:
        with self.changed:
            place = tuple(round(value, 4) for value in (*blob.position, blob.angle, *blob.dimension, blob.area))
            self.told.append((what, blob.session_id, *place))
            self.changed.notify_all()

    def wait_for(self, what: str) -> None:
        with self.changed:
            assert self.changed.wait_for(lambda: any(told[0] == what for told in self.told), PATIENCE_S), what


@contextmanager
def blob_client() -> Iterator[tuple[BlobLog, str]]:
    """Yield what a running python-tuio client tells, and where to send to."""
    log, client = BlobLog(), TuioClient(("127.0.0.1", 0))
    client.add_listener(log)
    BlockingOSCUDPServer.__init__(client, ("127.0.0.1", 0), client)
    thread = threading.Thread(target=client.serve_forever, args=(0.01,), daemon=True)
    thread.start()
    try:
        yield log, f"127.0.0.1:{client.socket.getsockname()[1]}"
    finally:
        client.shutdown()
        thread.join(PATIENCE_S)
        client.server_close()


def phone(x: float) -> TableObject:
    return TableObject(9, ((x, 0.25), (x + 0.2, 0.25), (x + 0.2, 0.5), (x, 0.5)), 8.0)


def test_python_tuio_sees_a_thing_that_is_put_down_pushed_and_taken_away() -> None:
    with blob_client() as (log, destination):
        output = TuioUdpOutput(TuioEncoder(SOURCE, 0, 1000, BLOB_2D), UdpSender([destination]), Blobs(ScreenMap(), 60))
        output.start()
        script = [(phone(0.1),), (phone(0.1),), *((phone(0.1 + 0.02 * k),) for k in range(10)), ()]
        for index, objects in enumerate(script):
            frame = TouchFrame(index, index * FRAME_NS, State.TRACKING, objects=objects, area_mm=AREA_MM)
            output.publish(frame, index * FRAME_NS)
        log.wait_for("remove")
        output.close()
    (added,) = (each for each in log.told if each[0] == "add")
    assert added[1:] == (1, 0.2, 0.375, 0.0, 0.2, 0.25, 0.05)
    moves = [each for each in log.told if each[0] == "move"]
    assert moves[-1][2] == pytest.approx(0.38, abs=0.01)
    assert [each[1] for each in log.told if each[0] == "remove"] == [1]


def test_oscdump_prints_a_fingertip_as_it_was_meant() -> None:
    with OscDump() as dump:
        encoder = TuioEncoder(SOURCE, 6, 1000, CURSOR_25D)
        output = TuioUdpOutput(encoder, UdpSender([dump.destination]), Fingertips(Screen(), full_mm=40.0))
        hover = Hover(1, 0.25, 0.75, 10.0, vz_mm_s=-20.0)
        output.publish(TouchFrame(0, 0, State.TRACKING, hovers=(hover,)), 0)
        touch = Cursor(1, 0.25, 0.75, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0, hover_id=1)
        output.publish(TouchFrame(1, FRAME_NS, State.TRACKING, (touch,)), FRAME_NS)
        dump.sync()
        assert dump.lines[:4] == [
            f'/tuio/25Dcur ss "source" "{SOURCE}"',
            '/tuio/25Dcur si "alive" 7',
            '/tuio/25Dcur sifffffff "set" 7 0.250000 0.750000 0.250000 0.000000 0.000000 -0.500000 0.000000',
            '/tuio/25Dcur si "fseq" 1000',
        ]
        assert dump.lines[6].startswith('/tuio/25Dcur sifffffff "set" 7 0.250000 0.750000 0.000000 ')
        output.close()
