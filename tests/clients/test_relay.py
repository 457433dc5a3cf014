"""The relay that loses and swaps datagrams does so as often, and as repeatably, as its tests rely on."""

import socket
import threading
from itertools import pairwise

from hypothesis import given, settings
from hypothesis import strategies as st

from clients.bundles import Mailbox
from clients.relay import LossyRelay

FOR_EVER_S = 600.0


def through(relay: LossyRelay, count: int) -> None:
    host, _, port = relay.destination.rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(count):
            sender.sendto(b"%d" % number, (host, int(port)))


def sent_through(count: int, loss: float, swap: float, seed: int) -> tuple[list[int], int, int]:
    """Return the numbers that arrived of those from 0 to ``count``, and how many were lost and swapped."""
    with Mailbox() as box:
        with LossyRelay(box.destination, loss, swap, seed, hold_s=FOR_EVER_S) as relay:
            through(relay, count)
        return [int(datagram) for datagram in box.take()], relay.lost, relay.swapped


def test_without_loss_and_swaps_everything_arrives_in_order() -> None:
    assert sent_through(100, loss=0.0, swap=0.0, seed=1) == (list(range(100)), 0, 0)


def test_a_fraction_is_lost_and_the_rest_keeps_its_order() -> None:
    arrived, lost, swapped = sent_through(200, loss=0.2, swap=0.0, seed=1)
    assert 20 < lost < 60
    assert (len(arrived), swapped) == (200 - lost, 0)
    assert arrived == sorted(arrived)


def test_with_every_datagram_swapped_pairs_change_places() -> None:
    assert sent_through(6, loss=0.0, swap=1.0, seed=1) == ([1, 0, 3, 2, 5, 4], 0, 3)


def test_the_last_one_held_back_arrives_when_the_relay_ends() -> None:
    assert sent_through(3, loss=0.0, swap=1.0, seed=1) == ([1, 0, 2], 0, 1)


def test_all_may_be_lost() -> None:
    assert sent_through(5, loss=1.0, swap=1.0, seed=1) == ([], 5, 0)


@settings(deadline=None, max_examples=20)
@given(
    count=st.integers(0, 60),
    loss=st.floats(0.0, 1.0),
    swap=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**32),
)
def test_each_arrives_once_or_is_counted_as_lost_and_the_same_again_for_a_seed(
    count: int, loss: float, swap: float, seed: int
) -> None:
    arrived, lost, swapped = sent_through(count, loss, swap, seed)
    assert len(set(arrived)) == len(arrived) == count - lost
    assert set(arrived) <= set(range(count))
    assert sum(later < earlier for earlier, later in pairwise(arrived)) == swapped
    assert sent_through(count, loss, swap, seed) == (arrived, lost, swapped)


def test_one_held_back_goes_alone_when_nothing_follows() -> None:
    with Mailbox() as box, LossyRelay(box.destination, loss=0.0, swap=1.0, seed=1) as relay:
        through(relay, 1)
        assert box._socket.recv(65536) == b"0"
        assert relay.swapped == 0


def test_sync_waits_for_all_but_the_one_held_back() -> None:
    with Mailbox() as box, LossyRelay(box.destination, loss=0.0, swap=1.0, seed=1, hold_s=FOR_EVER_S) as relay:
        through(relay, 5)
        relay.sync()
        assert [int(datagram) for datagram in box.take()] == [1, 0, 3, 2]


def test_it_leaves_no_thread_behind() -> None:
    before = threading.active_count()
    sent_through(10, loss=0.5, swap=0.5, seed=1)
    assert threading.active_count() == before
