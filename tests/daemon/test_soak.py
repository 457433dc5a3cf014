"""Ten minutes of `make soak`, and that the soak would notice what it looks for."""

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from touchd.model import Cursor
from touchd.outputs.tuio import FSEQ_MAX, SESSION_ID_MAX, TuioEncoder

from soak.client import StrictClient
from soak.verdict import Sample, leaks

TESTS = Path(__file__).parents[1]
PATIENCE_S = 600.0
SAMPLE = Sample(
    hours=1.0,
    resident_bytes=100_000_000,
    threads=6,
    descriptors=11,
    fseq=1,
    session_id=1,
    touches=1,
    frames_a_second=1500.0,
)


def test_in_ten_minutes_of_frames_nothing_grows_and_nothing_sticks_though_all_numbers_come_round() -> None:
    # Of two samples in each half of the day malloc may keep some MB in both; of five it does not in all.
    ended = subprocess.run(
        [sys.executable, "-m", "soak", "--minutes", "10", "--sample-minutes", "1"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert (ended.returncode, ended.stderr) == (0, ""), ended.stdout
    assert ended.stdout.splitlines()[-1] == "soak: nothing was wrong"
    assert "fseq came round 1 times, session ids 1 times" in ended.stdout


def test_a_flat_day_is_no_leak_even_if_malloc_keeps_some_memory_for_a_while() -> None:
    kept = replace(SAMPLE, resident_bytes=125_000_000)
    assert leaks([SAMPLE, kept, SAMPLE, kept]) == []


def test_memory_that_never_comes_back_is_a_leak() -> None:
    grown = [replace(SAMPLE, resident_bytes=100_000_000 + hour * 1_600_000) for hour in range(4)]
    assert leaks(grown) == [
        "resident memory grew from 100.00 MB, its least in the first half, to 103.20 MB in the second; it may by 3 MB"
    ]


def test_a_thread_or_descriptor_more_is_a_leak() -> None:
    assert leaks([SAMPLE, replace(SAMPLE, threads=7, descriptors=12)]) == [
        "the number of threads changed: 6, 7",
        "the number of file descriptors changed: 11, 12",
    ]


@pytest.fixture
def client() -> Iterator[StrictClient]:
    with StrictClient() as client:
        yield client


def frames(encoder: TuioEncoder, *cursors: Sequence[int]) -> list[bytes]:
    """Return the datagrams of frames with these cursors by session id."""
    each = [[Cursor(i, 0.5, 0.5, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0) for i in ids] for ids in cursors]
    return [datagram for one in each for datagram in encoder.next_frame(one).split(4096)]


def faults(client: StrictClient, datagrams: Sequence[bytes]) -> list[str]:
    """Return what the client says is wrong with datagrams, without where it was."""
    for datagram in datagrams:
        client.take(datagram)
    return [fault.partition(": ")[2] for fault in client.faults]


def encoder(offset: int = 0, first_fseq: int = 1) -> TuioEncoder:
    return TuioEncoder("touchd-test@127.0.0.1", offset, first_fseq)


def test_the_soaks_client_accepts_touches_that_come_and_go_over_both_wraps(client: StrictClient) -> None:
    sender = encoder(offset=SESSION_ID_MAX - 1, first_fseq=FSEQ_MAX)
    assert faults(client, frames(sender, (1,), (1, 2), (2, 3), ())) == []
    assert (client.fseq_wraps, client.id_wraps, client.touches) == (1, 1, 3)
    assert client.verdict() == []


def test_the_soaks_client_accepts_a_sender_that_clears_and_begins_ahead(client: StrictClient) -> None:
    sender = encoder(first_fseq=5)
    later = encoder(first_fseq=500)
    sent = [*frames(sender, (1,)), sender.clear(), later.clear(), *frames(later, (2,), ())]
    assert faults(client, sent) == []


def test_the_soaks_client_notices_a_frame_that_was_lost(client: StrictClient) -> None:
    first, _, third = frames(encoder(), (), (), ())
    assert faults(client, [first, third]) == ["its fseq is 3 after 1"]


def test_the_soaks_client_notices_a_sender_that_begins_anew_with_lower_numbers(client: StrictClient) -> None:
    anew = encoder()
    sent = [*frames(encoder(first_fseq=9), ()), anew.clear(), *frames(anew, ())]
    assert faults(client, sent) == ["its fseq is 1 after 9"]


def test_the_soaks_client_notices_a_touch_that_comes_back(client: StrictClient) -> None:
    assert faults(client, frames(encoder(), (4,), (), (4,))) == ["it begins the session 4 after 4"]


def test_the_soaks_client_notices_what_is_no_bundle(client: StrictClient) -> None:
    (fault,) = faults(client, [b"junk"])
    assert fault.startswith("it cannot be read: ")


def test_the_soaks_client_notices_a_press_in_the_corner(client: StrictClient) -> None:
    corner = encoder().next_frame([Cursor(1, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0)])
    assert faults(client, corner.split(4096)) == ["it sets 1 to 0.0, 0.0, [0.0, 0.0, 0.0]"]


def test_the_soaks_client_tells_in_the_end_of_what_it_still_holds(client: StrictClient) -> None:
    assert faults(client, frames(encoder(), (1, 2))) == []
    assert client.verdict() == [f"{client.destination} still holds [1, 2]"]
