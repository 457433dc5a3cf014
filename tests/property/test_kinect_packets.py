"""Whatever happens to packets: whole frames, partial ones that say so, or nothing; never a wrong pixel, never an error.

What cannot be noticed is not tried here: a payload changed but not its length, for the device has no checksum; a
header changed into just the one that was due.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import chain
from random import Random

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from touchd.sources.kinect.packets import DepthPacketFrame, PacketAssembler
from touchd.sources.kinect.unpack import HEIGHT, PICTURE_BYTES, RowUnpacker, pixels_of

from kinect_stream import STRIDE, Packet, pack_pixels, random_picture, stream, transfers, with_ticks_of_their_own

PICTURES = [random_picture(seed) for seed in range(6)]
PACKED = [pack_pixels(picture) for picture in PICTURES]
COUNT = 242 * len(PICTURES)

Fault = Callable[[list[Packet]], list[Packet]]

places = st.integers(0, COUNT - 1)
few = st.integers(1, 8)
# 14, 228 and 242 are where sequence numbers or places come round; 256 and 512 lose as if nothing was lost.
many = st.sampled_from([9, 14, 31, 32, 100, 228, 241, 242, 243, 250, 255, 256, 257, 261, 484, 512])


def lose(place: int, count: int) -> Fault:
    return lambda packets: packets[:place] + packets[place + count :]


def repeat(place: int, count: int, later: int) -> Fault:
    def fault(packets: list[Packet]) -> list[Packet]:
        behind = place + count + later
        return packets[:behind] + packets[place : place + count] + packets[behind:]

    return fault


def move(place: int, count: int, later: int) -> Fault:
    def fault(packets: list[Packet]) -> list[Packet]:
        taken, rest = packets[place : place + count], packets[:place] + packets[place + count :]
        return rest[: place + later] + taken + rest[place + later :]

    return fault


def exchange(place: int, count: int, other: int) -> Fault:
    def fault(packets: list[Packet]) -> list[Packet]:
        a, b = packets[place : place + count], packets[place + other : place + other + count]
        between, behind = packets[place + count : place + other], packets[place + other + count :]
        return packets[:place] + b + between + a + behind

    return fault


def change(place: int, how: Callable[[Packet], Packet]) -> Fault:
    return lambda packets: [how(packet) if index == place else packet for index, packet in enumerate(packets)]


def cut(place: int, length: int) -> Fault:
    return change(place, lambda packet: replace(packet, payload=packet.payload[:length]))


def lengthen(place: int, by: int) -> Fault:
    return change(place, lambda packet: replace(packet, payload=packet.payload + b"\xff" * by))


losses = st.builds(lose, places, few | many)
lengths = st.builds(cut, places, st.integers(0, 1747)) | st.builds(lengthen, places, st.integers(1, 200))
repeats = st.builds(repeat, places, st.just(1) | few | st.just(32), st.integers(0, 6) | many)
moves = st.builds(move, places, few | st.just(32), few | many) | st.builds(
    exchange, places, st.just(32), st.sampled_from([32, 64, 256, 512])
)
header_damage = st.one_of(
    st.builds(change, places, st.builds(lambda m: lambda p: replace(p, magic=m), st.binary(min_size=2, max_size=2))),
    st.builds(
        change,
        places,
        st.builds(
            lambda f: lambda p: replace(p, flag=f), st.sampled_from([0x71, 0x72, 0x75, 0x70]) | st.integers(0, 255)
        ),
    ),
    st.builds(
        change,
        places,
        st.builds(
            lambda by: lambda p: replace(p, sequence=(p.sequence + by) % 256), st.integers(-7, 7) | st.integers(0, 255)
        ),
    ),
    st.builds(change, places, st.builds(lambda t: lambda p: replace(p, ticks=t), st.integers(0, 2**32 - 1))),
)
streams = st.builds(
    lambda sequence, ticks, stamp: stamp(stream(PACKED, sequence, ticks)),
    st.integers(0, 255),
    st.sampled_from([0, 2**32 - 5_000_000]) | st.integers(0, 2**32 - 1),
    st.sampled_from([list, with_ticks_of_their_own]),
)


def fed(packets: Sequence[Packet]) -> list[DepthPacketFrame]:
    assembler = PacketAssembler()
    frames = [assembler.feed(packet.as_bytes()) for packet in packets]
    return [frame for frame in frames if frame is not None]


def is_whole_and_right(frame: DepthPacketFrame) -> bool:
    return not frame.missing and any(np.array_equal(frame.raw, picture) for picture in PICTURES)


def is_right_but_for_what_is_missing(frame: DepthPacketFrame) -> bool:
    came = np.ones(480 * 640, bool)
    for slot in frame.missing:
        came[pixels_of(slot)] = False
    raw = frame.raw.reshape(-1)
    return bool((raw[~came] == 2047).all()) and any(
        np.array_equal(raw[came], picture.reshape(-1)[came]) for picture in PICTURES
    )


def apply(faults: Sequence[Fault], packets: list[Packet]) -> list[Packet]:
    for fault in faults:
        packets = fault(packets)
    return packets


@settings(deadline=None, max_examples=150)
@given(streams, st.lists(losses | lengths | repeats | moves, max_size=8))
def test_lost_cut_repeated_and_moved_packets_leave_no_wrong_pixel_in_any_frame(
    packets: list[Packet], faults: list[Fault]
) -> None:
    for frame in fed(apply(faults, packets)):
        assert is_whole_and_right(frame) or is_right_but_for_what_is_missing(frame)


@settings(deadline=None, max_examples=150)
@given(streams, st.lists(header_damage | lengths, max_size=6), st.lists(losses | repeats, max_size=4))
def test_damaged_headers_leave_no_wrong_pixel_in_a_frame_that_claims_to_be_whole(
    packets: list[Packet], damage: list[Fault], faults: list[Fault]
) -> None:
    for frame in fed(apply(faults, apply(damage, packets))):
        assert frame.missing or is_whole_and_right(frame)


@settings(deadline=None, max_examples=100)
@given(streams, places, few)
def test_a_short_loss_spoils_no_frame_that_it_does_not_touch(packets: list[Packet], place: int, count: int) -> None:
    whole = [frame for frame in fed(lose(place, count)(packets)) if not frame.missing]
    touched = {index // 242 for index in range(place, min(place + count, COUNT))}
    assert len(whole) == len(PICTURES) - len(touched)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.binary(max_size=40) | st.binary(min_size=10, max_size=1800).map(lambda tail: b"RB" + tail)))
def test_anything_at_all_is_no_error(packets: list[bytes]) -> None:
    assembler = PacketAssembler()
    for packet in [*packets, *(p.as_bytes() for p in stream(PACKED[:1])), *packets]:
        frame = assembler.feed(packet)
        assert frame is None or frame.missing or is_whole_and_right(frame)


@settings(deadline=None, max_examples=40)
@given(streams, st.lists(losses | lengths | repeats | moves | header_damage, max_size=6), st.integers(0, 999))
def test_transfers_give_the_same_frames_as_their_packets_one_by_one(
    packets: list[Packet], faults: list[Fault], seed: int
) -> None:
    spoiled, random = apply(faults, packets), Random(seed)
    gaps: list[list[bytes]] = [[packet.as_bytes()] + [b""] * (random.random() < 0.1) for packet in spoiled]
    assembler = PacketAssembler()
    frames = [
        frame
        for transfer, sizes in transfers(list(chain.from_iterable(gaps)))
        for frame in assembler.feed_transfer(transfer, sizes, STRIDE)
    ]
    expected = fed(spoiled)
    assert [(frame.ticks, frame.missing) for frame in frames] == [(frame.ticks, frame.missing) for frame in expected]
    assert all(np.array_equal(a.raw, b.raw) for a, b in zip(frames, expected, strict=True))


def bit_by_bit(packed: bytes) -> list[int]:
    bits = "".join(f"{octet:08b}" for octet in packed)
    return [int(bits[at : at + 11], 2) for at in range(0, len(bits), 11)]


@st.composite
def some_rows(draw: st.DrawFn) -> tuple[int, bytes]:
    count = draw(st.integers(1, 3))
    return draw(st.integers(0, HEIGHT - count)), draw(st.binary(min_size=880 * count, max_size=880 * count))


@settings(deadline=None, max_examples=60)
@given(some_rows())
def test_rows_are_unpacked_as_bit_by_bit_and_others_left_alone(rows: tuple[int, bytes]) -> None:
    first, content = rows
    last = first + len(content) // 880
    packed: NDArray[np.uint8] = np.random.default_rng(7).integers(0, 256, PICTURE_BYTES, dtype=np.uint8)
    packed[880 * first : 880 * last] = np.frombuffer(content, np.uint8)
    out = np.full((480, 640), 0xBEEF, np.uint16)
    RowUnpacker().unpack_rows(packed, first, last, out)
    assert out[first:last].reshape(-1).tolist() == bit_by_bit(content)
    assert (out[:first] == 0xBEEF).all()
    assert (out[last:] == 0xBEEF).all()
