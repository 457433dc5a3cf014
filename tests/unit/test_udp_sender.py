import errno
import os
import socket
import threading
import time
from typing import Any

from touchd.model import Cursor
from touchd.outputs.names import Address, Backoff, look_up
from touchd.outputs.tuio import EncodedFrame, TuioEncoder
from touchd.outputs.udp import UdpSender, open_udp_socket

from clients.bundles import Mailbox, read_bundle

PATIENCE_S = 30.0
AT_ONCE = Backoff(first_s=0.001, longest_s=0.002)


def frame_of(count: int) -> EncodedFrame:
    cursors = [Cursor(i + 1, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0) for i in range(count)]
    return TuioEncoder("touchd-test-main@127.0.0.1", 0, 1).next_frame(cursors)


def box_name(box: Mailbox) -> str:
    return f"cave.local:{box.port}"


def local(port: int, max_bytes: int = 4096) -> Address:
    return Address(socket.AF_INET, ("127.0.0.1", port), max_bytes)


def test_every_destination_gets_every_frame() -> None:
    with Mailbox() as a, Mailbox() as b, UdpSender([a.destination, b.destination]) as sender:
        frame = frame_of(3)
        sender.send(frame)
        sender.send(frame)
        assert a.take() == b.take() == [*frame.split(4096)] * 2
        assert [(one.sent, one.failed, one.last_error) for one in sender.status()] == [(2, 0, None)] * 2
        assert [one.address for one in sender.status()] == [a.destination, b.destination]


def test_copies_of_a_datagram_are_sent_as_often_as_asked() -> None:
    with Mailbox() as box, UdpSender([box.destination]) as sender:
        sender.send_bytes(b"once more", copies=3)
        assert box.take() == [b"once more"] * 3


def test_nobody_listening_is_no_failure_and_costs_the_others_nothing() -> None:
    with Mailbox() as gone:
        nobody = gone.destination
    with Mailbox() as box, UdpSender([nobody, box.destination]) as sender:
        for _ in range(5):
            sender.send(frame_of(1))
        assert len(box.take()) == 5
        assert [(one.sent, one.failed) for one in sender.status()] == [(5, 0), (5, 0)]


def test_sixty_cursors_reach_a_loopback_destination_in_one_datagram() -> None:
    with Mailbox() as box, UdpSender([box.destination]) as sender:
        sender.send(frame_of(60))
        assert [len(read_bundle(datagram).sets) for datagram in box.take()] == [60]


def test_ipv6_works_or_the_status_says_why_not() -> None:
    try:
        box = Mailbox(socket.AF_INET6)
    except OSError:  # this machine has no IPv6
        with UdpSender(["[::1]:3333"]) as sender:
            sender.send(frame_of(1))
            assert sender.status()[0].failed == 1
            assert str(sender.status()[0].last_error).startswith("Cannot send to [::1]:3333: ")
        return
    with box, UdpSender([box.destination]) as sender:
        sender.send(frame_of(60))
        assert [len(read_bundle(datagram).sets) for datagram in box.take()] == [60]
        assert sender.status()[0].address == box.destination


def test_a_broadcast_address_is_a_destination_too() -> None:
    with UdpSender(["127.255.255.255:9"]) as sender:
        sender.send(frame_of(1))
        assert [(one.sent, one.last_error) for one in sender.status()] == [(1, None)]


def test_sockets_do_not_block() -> None:
    with open_udp_socket(socket.AF_INET) as opened:
        assert not opened.getblocking()


def test_what_the_system_refuses_is_counted_with_its_reason_and_not_raised() -> None:
    with Mailbox() as box, UdpSender([box.destination]) as sender:
        sender.send_bytes(b"x" * 70_000, copies=2)
        (status,) = sender.status()
        assert (status.sent, status.failed) == (0, 2)
        assert status.last_error == f"Cannot send to {box.destination}: {os.strerror(errno.EMSGSIZE)}."


def test_sends_after_the_close_are_counted_as_failed() -> None:
    with Mailbox() as box:
        sender = UdpSender([box.destination])
        sender.close()
        sender.send(frame_of(1))
        sender.close()
        assert sender.status()[0].failed == 1
        assert sender.status()[0].last_error == f"Cannot send to {box.destination}: the output is closed."


def test_a_look_up_that_hangs_keeps_nobody_waiting() -> None:
    answer = threading.Event()

    def hang(_host: str, port: int) -> Address:
        answer.wait(PATIENCE_S)
        return local(port)

    with Mailbox() as box, UdpSender([box_name(box), box.destination], look_up=hang) as sender:
        sender.send(frame_of(1))
        named, numeric = sender.status()
        assert (named.sent, named.failed, named.address) == (0, 1, None)
        assert named.last_error == (
            f"Cannot send to cave.local:{box.port}: its name has no address yet (it is being looked up)."
        )
        assert numeric.sent == 1
        assert not sender.wait_resolved(0.0)
        answer.set()
        assert sender.wait_resolved(PATIENCE_S)
        sender.send_bytes(b"found", copies=1)
        assert box.take()[-1] == b"found"
        assert sender.status()[0].address == box.destination


def test_a_sender_with_a_hanging_look_up_closes_at_once_and_leaves_no_thread_behind() -> None:
    answer = threading.Event()

    def hang(_host: str, port: int) -> Address:
        answer.wait(PATIENCE_S)
        return local(port)

    sender = UdpSender(["hanging.local:3333"], look_up=hang)
    (thread,) = (thread for thread in threading.enumerate() if thread.name == "look-up of hanging.local")
    sender.close()
    assert thread.is_alive()
    answer.set()
    thread.join(PATIENCE_S)
    assert not thread.is_alive()


def test_a_name_is_asked_for_until_it_is_known() -> None:
    answers = [socket.gaierror(socket.EAI_AGAIN, "Try again"), socket.gaierror(socket.EAI_NONAME, "Unknown")]

    def late(_host: str, port: int) -> Address:
        if answers:
            raise answers.pop()
        return local(port)

    with (
        Mailbox() as box,
        UdpSender([box_name(box)], look_up=late, backoff=AT_ONCE) as sender,
    ):
        assert sender.wait_resolved(PATIENCE_S)
        assert answers == []
        sender.send_bytes(b"found", copies=1)
        assert box.take() == [b"found"]


def test_a_name_that_works_is_asked_for_once() -> None:
    asked = []

    def counted(host: str, port: int) -> Address:
        asked.append(host)
        return local(port)

    with (
        Mailbox() as box,
        UdpSender([box_name(box)], look_up=counted, backoff=Backoff(0.0, 0.0)) as sender,
    ):
        assert sender.wait_resolved(PATIENCE_S)
        for _ in range(100):
            sender.send_bytes(b"hello", copies=10)
            box.take()
        assert asked == ["cave.local"]


def test_a_name_that_cannot_be_one_is_counted_with_the_reason() -> None:
    asked = threading.Semaphore(0)

    def watched(host: str, port: int) -> Address:
        asked.release()
        return look_up(host, port)

    too_long = "a" * 64 + ".invalid"
    with UdpSender([f"{too_long}:3333"], look_up=watched, backoff=AT_ONCE) as sender:
        for _ in range(2):  # the second time, the outcome of the first is known
            assert asked.acquire(timeout=PATIENCE_S)
        sender.send_bytes(b"lost", copies=3)
        (status,) = sender.status()
        assert status.failed == 3
        assert f"Cannot send to {too_long}:3333: its name has no address yet (" in str(status.last_error)
        assert "it is being looked up" not in str(status.last_error)


class Unreliable(socket.socket):
    """A real UDP socket that fails for one port, or from one send on, as no loopback destination would."""

    unreachable_port = 0
    fails_at = -1
    sends = 0

    def sendto(self, data: Any, address: Any) -> int:  # type: ignore[override]  # one of its two forms will do
        self.sends += 1
        if address[1] == self.unreachable_port:
            raise OSError(errno.EHOSTUNREACH, os.strerror(errno.EHOSTUNREACH))
        if self.sends == self.fails_at:
            raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))
        return super().sendto(data, address)


def test_a_host_that_has_moved_is_looked_up_again() -> None:
    asked_again = threading.Event()

    with Mailbox() as old, Mailbox() as new:

        def moved(_host: str, _port: int) -> Address:
            if not asked_again.is_set():
                asked_again.set()
                return local(old.port)
            return local(new.port)

        def unreachable(family: socket.AddressFamily) -> socket.socket:
            opened = Unreliable(family, socket.SOCK_DGRAM)
            opened.unreachable_port = old.port
            return opened

        with UdpSender(["cave.local:3333"], moved, unreachable, AT_ONCE) as sender:
            assert sender.wait_resolved(PATIENCE_S)
            deadline_s = time.monotonic() + PATIENCE_S
            while sender.status()[0].sent == 0:
                assert time.monotonic() < deadline_s
                sender.send_bytes(b"hello", copies=1)
            assert new.take() == [b"hello"]
            assert sender.status()[0].last_error == "Cannot send to cave.local:3333: No route to host."


def test_after_a_send_that_worked_the_pauses_between_look_ups_begin_anew() -> None:
    pauses: list[float] = []
    asked = threading.Semaphore(0)
    sockets: list[Unreliable] = []

    class Noting(Backoff):
        def after(self, pause_s: float) -> float:
            pauses.append(pause_s)
            return pause_s + 0.002

    def watched(_host: str, port: int) -> Address:
        asked.release()
        return local(port)

    def noted(family: socket.AddressFamily) -> socket.socket:
        sockets.append(Unreliable(family, socket.SOCK_DGRAM))
        return sockets[-1]

    with Mailbox() as box, UdpSender([box_name(box)], watched, noted, Noting(first_s=0.001)) as sender:
        assert asked.acquire(timeout=PATIENCE_S)
        assert sender.wait_resolved(PATIENCE_S)
        sender.send_bytes(b"hello", copies=1)
        for unreachable_port in (box.port, box.port, 0, box.port):
            sockets[0].unreachable_port = unreachable_port
            sender.send_bytes(b"hello", copies=1)
            while unreachable_port and not asked.acquire(timeout=0.01):
                sender.send_bytes(b"hello", copies=1)
    assert pauses[:3] == [0.0, 0.002, 0.004]
    assert 0.001 in pauses[3:]


def test_after_a_datagram_that_did_not_go_out_the_rest_of_its_frame_stays_here() -> None:
    def full_at_second(family: socket.AddressFamily) -> socket.socket:
        opened = Unreliable(family, socket.SOCK_DGRAM)
        opened.fails_at = 2
        return opened

    def small(_host: str, port: int) -> Address:
        return local(port, max_bytes=1472)

    with (
        Mailbox() as box,
        UdpSender([box_name(box)], small, full_at_second) as sender,
    ):
        assert sender.wait_resolved(PATIENCE_S)
        sender.send(frame_of(60))
        assert len(box.take()) == 1
        sender.send(frame_of(60))
        assert len(box.take()) == 4
        assert (sender.status()[0].sent, sender.status()[0].failed) == (5, 1)
