import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.formats.recording import open_recording

from virtual_kinect.faults import Faults
from virtual_kinect.pictures import array_of, gradient_pictures, picture_of, recorded_pictures
from virtual_kinect.stream import DepthStream, Film, StreamSettings, pack

SECOND = 8000  # microframes
PICTURES = gradient_pictures(3)


def bits_of(packed: bytes, width: int) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Return the values of a big-endian bit stream, read bit by bit."""
    bits = np.unpackbits(np.frombuffer(packed, np.uint8)).reshape(-1, width).astype(np.int64)
    return bits @ (1 << np.arange(width - 1, -1, -1))


def stream_of(bits: int = 11, first_ticks: int = 0, *, mirror: bool = False) -> DepthStream:
    return DepthStream(Film(PICTURES), StreamSettings(100, bits, 30, first_ticks), lambda: mirror)


def packets_of(stream: DepthStream, frame: int) -> list[bytes]:
    per_frame = stream.settings.packets_per_frame
    return [stream.packet(number) for number in range(frame * per_frame, (frame + 1) * per_frame)]


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([10, 11]), st.integers(0, 2**32 - 1))
def test_packed_pixels_are_a_big_endian_bit_stream(bits: int, seed: int) -> None:
    raw = np.random.default_rng(seed).integers(0, 1 << bits, (480, 640))
    assert np.array_equal(bits_of(pack(picture_of(raw), bits), bits), raw.ravel())


def test_a_frame_of_11_bits_comes_in_242_packets_with_one_short_one_at_the_end() -> None:
    packets = packets_of(stream_of(), 0)
    assert len(packets) == 242
    assert [len(packet) - 12 for packet in packets] == [1748] * 241 + [1132]
    assert [packet[3] for packet in packets] == [0x71] + [0x72] * 240 + [0x75]
    assert {packet[:3] for packet in packets} == {b"RB\0"}
    assert np.array_equal(bits_of(b"".join(p[12:] for p in packets), 11), array_of(PICTURES[0]).ravel())


def test_a_frame_of_10_bits_comes_in_220_packets_without_the_lowest_bit() -> None:
    packets = packets_of(stream_of(bits=10), 1)
    assert len(packets) == 220
    assert np.array_equal(bits_of(b"".join(p[12:] for p in packets), 10), array_of(PICTURES[1]).ravel() >> 1)


def test_a_mirrored_frame_has_left_and_right_exchanged() -> None:
    packets = packets_of(stream_of(mirror=True), 0)
    seen = bits_of(b"".join(p[12:] for p in packets), 11).reshape(480, 640)
    assert np.array_equal(seen, array_of(PICTURES[0])[:, ::-1])


def test_the_pictures_are_played_in_the_order_asked_for_and_again() -> None:
    film = Film(PICTURES, order=[2, 2, 0])
    assert [film.picture_of(frame) for frame in range(7)] == [2, 2, 0, 2, 2, 0, 2]


def test_packets_count_up_to_255_and_begin_again() -> None:
    stream = stream_of()
    sequence = [stream.packet(number)[5] for number in range(600)]
    assert sequence == [number % 256 for number in range(600)]


def test_the_device_clock_rises_by_a_frame_and_wraps() -> None:
    stream = stream_of(first_ticks=2**32 - 1_000_000)
    ticks = [struct.unpack_from("<I", stream.packet(242 * frame), 8)[0] for frame in range(3)]
    assert ticks == [2**32 - 1_000_000, 1_002_155, 3_004_310]


def test_the_packets_of_a_second_are_spread_over_its_8000_microframes() -> None:
    stream = stream_of()
    numbers = [stream.number_at(microframe) for microframe in range(100, 100 + SECOND)]
    sent = [number for number in numbers if number is not None]
    assert stream.number_at(99) is None
    assert sent == list(range(len(sent)))
    assert len(sent) == pytest.approx(242 * 60_000_000 / 2_002_155, abs=1)
    quiet = [microframe for microframe, number in enumerate(numbers) if number is None]
    assert max(b - a for a, b in pairwise(quiet)) < 12


def test_faults_take_the_share_of_packets_that_they_are_asked_for() -> None:
    packet = stream_of().packet(5)
    dropping = Faults(seed=1, drop=0.3)
    assert sum(dropping.damaged(n, packet) == b"" for n in range(10_000)) == pytest.approx(3000, abs=200)
    assert [Faults(seed=1, drop=0.3).damaged(n, packet) for n in range(50)] == [
        dropping.damaged(n, packet) for n in range(50)
    ]
    cutting = Faults(truncate=1.0)
    assert cutting.damaged(0, packet) == packet[: len(packet) // 2]


def test_a_corrupt_packet_differs_in_one_byte_of_its_header_that_matters() -> None:
    packet = stream_of().packet(5)
    for number in range(100):
        damaged = Faults(corrupt=1.0).damaged(number, packet)
        changed = [at for at, (a, b) in enumerate(zip(packet, damaged, strict=True)) if a != b]
        assert len(changed) == 1
        assert changed[0] in {0, 1, 3, 5}


def test_named_packets_alone_are_damaged() -> None:
    packet = stream_of().packet(5)
    faults = Faults(drop_packets=(3,), truncate_packets=(4,), corrupt_packets=(6,))
    assert [n for n in range(10) if faults.damaged(n, packet) != packet] == [3, 4, 6]


def test_faults_survive_their_way_to_another_process() -> None:
    faults = Faults(seed=7, drop=0.1, drop_packets=(1, 2), unplug_after_controls=3)
    assert Faults.from_json(faults.as_json()) == faults


def test_a_recording_is_played_as_it_is(desk_recording: Path) -> None:
    recording = open_recording(desk_recording)
    pictures = recorded_pictures(desk_recording, range(2, 5))
    assert len(pictures) == 3
    for index, picture in enumerate(pictures, 2):
        assert np.array_equal(array_of(picture), recording.read(index).raw)


def test_pictures_that_no_kinect_has_are_refused() -> None:
    with pytest.raises(ValueError, match=r"480x640 values from 0 to 2047, this one is .* from 0 to 2048"):
        picture_of(np.append(np.zeros(640 * 480 - 1, int), 2048).reshape(480, 640))
