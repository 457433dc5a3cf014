import ctypes
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from touchd.sources.kinect.packets import DepthPacketFrame, PacketAssembler, frames_missed
from touchd.sources.kinect.unpack import pixels_of

from kinect_stream import (
    FRAME_TICKS,
    STRIDE,
    Packet,
    pack_pixels,
    random_picture,
    stream,
    transfers,
    with_ticks_of_their_own,
)

PICTURES = [random_picture(seed) for seed in range(4)]
PACKED = [pack_pixels(picture) for picture in PICTURES]


def packets(frames: int = 3) -> list[Packet]:
    return stream(PACKED[:frames], first_sequence=200, first_ticks=77)


def without(sent: Sequence[Packet], lost: Iterable[int]) -> list[Packet]:
    gone = set(lost)
    return [packet for index, packet in enumerate(sent) if index not in gone]


def fed(assembler: PacketAssembler, sent: Iterable[Packet]) -> list[DepthPacketFrame]:
    frames = [assembler.feed(packet.as_bytes()) for packet in sent]
    return [frame for frame in frames if frame is not None]


def missing_of(sent: Iterable[Packet]) -> list[tuple[int, ...]]:
    return [frame.missing for frame in fed(PacketAssembler(), sent)]


def test_an_undisturbed_stream_gives_every_picture_with_the_device_s_time() -> None:
    frames = fed(PacketAssembler(), packets(4))
    assert [(frame.ticks, frame.missing) for frame in frames] == [(77 + n * FRAME_TICKS, ()) for n in range(4)]
    for frame, picture in zip(frames, PICTURES, strict=True):
        np.testing.assert_array_equal(frame.raw, picture)


def test_a_picture_may_be_kept_and_does_not_change_when_the_next_ones_come() -> None:
    assembler = PacketAssembler()
    (first,) = fed(assembler, packets(1))
    fed(assembler, packets(4)[242:])
    np.testing.assert_array_equal(first.raw, PICTURES[0])
    with pytest.raises(ValueError, match="read-only"):
        first.raw[0, 0] = 1


def test_packets_before_the_first_start_are_skipped() -> None:
    assembler = PacketAssembler()
    frames = fed(assembler, packets()[100:])
    assert [frame.missing for frame in frames] == [(), ()]
    assert assembler.counts.skipped == 142


def test_a_lost_packet_s_pixels_have_no_reading_and_all_others_are_right() -> None:
    assembler = PacketAssembler()
    (frame,) = fed(assembler, without(packets(1), [100, 101, 240]))
    assert frame.missing == (100, 101, 240)
    expected = PICTURES[0].copy().reshape(-1)
    for slot in frame.missing:
        expected[pixels_of(slot)] = 2047
    np.testing.assert_array_equal(frame.raw.reshape(-1), expected)
    assert assembler.counts.lost == 3
    assert (assembler.counts.whole, assembler.counts.partial, assembler.counts.dropped) == (0, 1, 0)


def test_the_pixels_of_a_packet_are_those_that_share_a_byte_with_it() -> None:
    pixels = np.arange(480 * 640)
    first_byte, last_byte = pixels * 11 // 8, (pixels * 11 + 10) // 8
    for slot in range(242):
        shared = pixels[(last_byte >= 1748 * slot) & (first_byte < 1748 * (slot + 1))]
        assert pixels_of(slot) == slice(shared[0], shared[-1] + 1)


@pytest.mark.parametrize(
    ("lost", "missing"),
    [
        (range(241, 242), [(241,), (), ()]),
        (range(237, 242), [(237, 238, 239, 240, 241), (), ()]),
        (range(240, 244), [(240, 241), (0, 1), ()]),
        (range(242, 243), [(), (0,), ()]),
        (range(242, 247), [(), (0, 1, 2, 3, 4), ()]),
        (range(200, 242), [tuple(range(200, 242)), (), ()]),  # the start that follows vouches for the place
        (range(100, 106), [(), ()]),  # nothing vouches for the places: given up
        (range(239, 245), [()]),  # nor here, and the next start is gone, too
        (range(200, 456), [()]),  # as many as the sequence has numbers, so that it goes on as if none was lost
        (range(242, 484), [(), ()]),  # a frame of which nothing came
    ],
)
def test_what_is_lost_together(lost: range, missing: list[tuple[int, ...]]) -> None:
    assert missing_of(without(packets(), lost)) == missing


def test_a_start_out_of_sequence_begins_a_frame_at_once() -> None:
    assembler = PacketAssembler()
    (frame,) = fed(assembler, packets(1)[:100] + stream(PACKED[1:2], first_sequence=17))
    np.testing.assert_array_equal(frame.raw, PICTURES[1])


def test_what_was_unpacked_of_a_frame_that_is_given_up_is_in_no_other() -> None:
    assembler = PacketAssembler()
    sent = [packet.as_bytes() for packet in [*packets(1)[:235], *stream(PACKED[1:2], first_sequence=17)]]
    frames = [
        frame for transfer, lengths in transfers(sent) for frame in assembler.feed_transfer(transfer, lengths, STRIDE)
    ]
    (frame,) = frames
    np.testing.assert_array_equal(frame.raw, PICTURES[1])


def test_a_packet_that_comes_twice_is_taken_once() -> None:
    sent = packets()
    assembler = PacketAssembler()
    twice = [packet for packet in sent for _ in range(2)]
    assert [frame.missing for frame in fed(assembler, twice)] == [(), (), ()]
    assert assembler.counts.repeated == len(sent)


def test_two_different_packets_for_the_same_place_are_neither_believed() -> None:
    sent = packets(1)
    wrong = replace(sent[99], sequence=sent[100].sequence)
    assert missing_of([*sent[:100], wrong, *sent[100:]]) == [(100,)]


@pytest.mark.parametrize("place", [0, 1, 120, 241])
@pytest.mark.parametrize("length", [0, 1, 1131, 1700, 1749, 1900])
def test_a_payload_of_another_length_counts_as_missing(place: int, length: int) -> None:
    sent = packets(2)
    sent[place] = replace(sent[place], payload=bytes(length))
    assembler = PacketAssembler()
    assert [frame.missing for frame in fed(assembler, sent)] == [(place,), ()]
    assert assembler.counts.misfits == 1


def test_a_packet_with_another_magic_or_without_a_whole_header_counts_as_lost() -> None:
    sent = [packet.as_bytes() for packet in packets(1)]
    sent[50] = b"RX" + sent[50][2:]
    sent[60] = sent[60][:11]
    assembler = PacketAssembler()
    frames = [frame for packet in sent if (frame := assembler.feed(packet)) is not None]
    assert [frame.missing for frame in frames] == [(50, 60)]
    assert assembler.counts.damaged == 2


@pytest.mark.parametrize("flag", [0x71, 0x75, 0x00, 0x82])
def test_a_flag_at_a_place_where_it_cannot_be_gives_the_frame_up(flag: int) -> None:
    sent = packets()
    sent[100] = replace(sent[100], flag=flag)
    assembler = PacketAssembler()
    assert [frame.ticks for frame in fed(assembler, sent)] == [77 + FRAME_TICKS, 77 + 2 * FRAME_TICKS]
    assert assembler.counts.dropped >= 1


def parts_of_two_frames() -> list[Packet]:
    """What is left when 128 frames are lost in the middle of one, after which all numbers are the same again."""
    late = stream(PACKED[1:2], first_sequence=200, first_ticks=77 + 128 * FRAME_TICKS)
    return packets(1)[:100] + late[100:]


@pytest.mark.parametrize("stamped", [list, with_ticks_of_their_own])
def test_parts_of_two_frames_are_not_taken_for_one(stamped: type[list[Packet]]) -> None:
    assembler = PacketAssembler()
    assert fed(assembler, stamped(parts_of_two_frames())) == []
    assert assembler.counts.dropped == 1


def test_a_device_whose_time_leaps_within_every_frame_is_believed_after_some() -> None:
    sent = stream(PACKED[:1] * 12)
    odd = [replace(packet, ticks=packet.ticks if packet.flag == 0x75 else 2**31) for packet in sent]
    assembler = PacketAssembler()
    assert len(fed(assembler, odd)) == 5
    assert (assembler.counts.whole, assembler.counts.dropped) == (5, 7)


def test_the_device_s_time_may_wrap_within_a_frame() -> None:
    sent = with_ticks_of_their_own(stream(PACKED[:2], first_ticks=2**32 - 1_000_000))
    assert missing_of(sent) == [(), ()]


def test_a_transfer_may_lie_in_the_memory_of_ctypes() -> None:
    assembler = PacketAssembler()
    memory = (ctypes.c_ubyte * (242 * STRIDE))()
    sent = [packet.as_bytes() for packet in packets(1)]
    for place, packet in enumerate(sent):
        ctypes.memmove(ctypes.addressof(memory) + place * STRIDE, packet, len(packet))
    (frame,) = assembler.feed_transfer(memoryview(memory), [len(packet) for packet in sent], STRIDE)
    np.testing.assert_array_equal(frame.raw, PICTURES[0])


def test_frames_that_the_host_did_not_get_are_counted_by_the_device_s_time() -> None:
    assert frames_missed(77, 77 + FRAME_TICKS) == 0
    assert frames_missed(77, 77 + 3 * FRAME_TICKS + 900) == 2
    assert frames_missed(2**32 - 5, FRAME_TICKS * 2 - 5) == 1
    assert frames_missed(77, 77) == 0
