"""Each bad neighbour of the bench is as bad as its name says."""

import errno
import os
import socket
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from touchd.lab import bench_destinations as bench
from touchd.lab.bench import endless, make_scene
from touchd.model import Cursor, State, TouchFrame
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import DestinationStatus

PATIENCE_S = 30.0
FRAMES = 20
NO_WAY = os.strerror(errno.ENETUNREACH)
FULL = os.strerror(errno.EAGAIN)


def sent_to(output: TuioUdpOutput) -> DestinationStatus:
    """Return how a destination fares after some frames with a touch."""
    touch = Cursor(1, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0)
    for index in range(FRAMES):
        output.publish(TouchFrame(index, 0, State.TRACKING, (touch,)), 0)
    (status,) = output.destinations()
    return status


def eventually(happened: Callable[[], bool]) -> bool:
    deadline_s = time.monotonic() + PATIENCE_S
    while not happened() and time.monotonic() < deadline_s:
        time.sleep(0.005)
    return happened()


def port_of(status: DestinationStatus) -> int:
    return int(status.destination.rpartition(":")[2])


def kernel_drops(port: int) -> int:
    """Return how many datagrams to a port of 127.0.0.1 the kernel had no room for: see proc(5), /proc/net/udp."""
    where = f"0100007F:{port:04X}" if sys.byteorder == "little" else f"7F000001:{port:04X}"
    rows = [line.split() for line in Path("/proc/net/udp").read_text("ascii").splitlines()[1:]]
    (drops,) = [int(row[-1]) for row in rows if row[1] == where]
    return drops


def test_a_good_neighbour_gets_everything() -> None:
    with bench.listening() as output:
        status = sent_to(output)
        assert (status.failed, kernel_drops(port_of(status))) == (0, 0)


def test_the_refusing_port_refuses_and_nobody_notices() -> None:
    with bench.refusing() as output, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        status = sent_to(output)
        assert status.failed == 0
        asking.connect(("127.0.0.1", port_of(status)))
        asking.send(b"is anybody there?")
        with pytest.raises(ConnectionRefusedError):
            asking.send(b"is anybody there?")


def test_no_send_reaches_the_unreachable_address() -> None:
    with bench.unreachable() as output:
        status = sent_to(output)
    assert (status.sent, status.last_error) == (0, f"Cannot send to 198.51.100.1:3333: {NO_WAY}.")


def test_a_name_of_an_unreachable_address_is_found_and_no_send_reaches_it() -> None:
    with bench.named_unreachable() as output:
        assert eventually(lambda: output.destinations()[0].address is not None)
        status = sent_to(output)
    assert (status.sent, status.last_error) == (0, f"Cannot send to gone.example:3333: {NO_WAY}.")


def test_the_unresolvable_name_is_refused_without_asking_anybody() -> None:
    with bench.unresolvable() as output:
        assert eventually(lambda: "too long" in str(sent_to(output).last_error))
        assert output.destinations()[0].sent == 0


def test_the_hanging_resolver_hangs_until_the_bench_ends() -> None:
    def hanging() -> bool:
        return any(thread.name == "look-up of hanging.example" for thread in threading.enumerate())

    with bench.hanging() as output:
        status = sent_to(output)
        assert hanging()
    assert (status.sent, status.address) == (0, None)
    assert "(it is being looked up)" in str(status.last_error)
    assert eventually(lambda: not hanging())


def test_the_receiver_that_never_reads_loses_what_it_has_no_room_for_and_nobody_notices() -> None:
    with bench.never_reading() as output:
        status = sent_to(output)
        assert status.failed == 0
        assert kernel_drops(port_of(status)) > 0


def test_the_full_send_buffer_takes_nothing() -> None:
    with bench.congested() as output:
        status = sent_to(output)
    assert (status.sent, status.last_error) == (0, f"Cannot send to 127.0.0.1:3333: {FULL}.")


def test_the_table_has_a_line_for_every_neighbour(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "_HOT_FRAMES", 12)
    scene = make_scene(1, "shell")
    head, *rows = bench.bench_destinations(scene.pipeline, endless(scene.frames), iter, paced_frames=12)
    assert head.startswith("frame to datagram in ms, beside")
    assert [row[:33].strip() for row in rows] == ["nobody", "another good one", *bench.NEIGHBOURS, "all the bad ones"]
    assert all(len(row[33:].split()) == 8 for row in rows)
    assert rows[0].count("+0.000") == 4
