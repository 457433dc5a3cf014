"""What a Kinect's depth endpoint sends, written down from the description of the protocol, without touchd's code."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FRAME_PACKETS = 242
FRAME_TICKS = 2_002_200
STRIDE = 1920
PACKETS_A_TRANSFER = 32


@dataclass(frozen=True, slots=True)
class Packet:
    flag: int
    sequence: int
    ticks: int
    payload: bytes
    magic: bytes = b"RB"

    def as_bytes(self) -> bytes:
        header = struct.pack("<2sBBBBHI", self.magic, 0, self.flag, 0, self.sequence, 0, self.ticks)
        return header + self.payload


def pack_pixels(raw: NDArray[np.uint16]) -> bytes:
    """Return 11-bit pixels as the device sends them: one bit after the other, the highest of each pixel first."""
    bits = (raw.reshape(-1, 1) >> np.arange(10, -1, -1, dtype=np.uint16)) & 1
    return np.packbits(bits.astype(np.uint8)).tobytes()


def random_picture(seed: int) -> NDArray[np.uint16]:
    return np.random.default_rng(seed).integers(0, 2048, (480, 640), dtype=np.uint16)


def frame_packets(packed: bytes, first_sequence: int, ticks: int) -> list[Packet]:
    """Return a frame's packets; its start has no time, as described for the device."""
    return [
        Packet(
            flag={0: 0x71, 241: 0x75}.get(slot, 0x72),
            sequence=(first_sequence + slot) % 256,
            ticks=ticks % 2**32 if slot else 0,
            payload=packed[1748 * slot : 1748 * (slot + 1)],
        )
        for slot in range(FRAME_PACKETS)
    ]


def stream(pictures: Sequence[bytes], first_sequence: int = 0, first_ticks: int = 0) -> list[Packet]:
    """Return the packets of packed pictures, one frame after the other."""
    return [
        packet
        for number, packed in enumerate(pictures)
        for packet in frame_packets(packed, first_sequence + number * FRAME_PACKETS, first_ticks + number * FRAME_TICKS)
    ]


def with_ticks_of_their_own(packets: Sequence[Packet]) -> list[Packet]:
    """Return the packets of a device that stamps each packet with the time at which it sends it."""
    step = FRAME_TICKS // FRAME_PACKETS
    return [
        replace(packet, ticks=(packet.ticks + (index % FRAME_PACKETS) * step) % 2**32 if packet.flag != 0x71 else 0)
        for index, packet in enumerate(packets)
    ]


def transfers(packets: Sequence[bytes]) -> list[tuple[memoryview, list[int]]]:
    """Return packets as transfers of 32, their bytes at multiples of STRIDE, and their lengths."""
    filled = []
    for first in range(0, len(packets), PACKETS_A_TRANSFER):
        some = packets[first : first + PACKETS_A_TRANSFER]
        room = bytearray(PACKETS_A_TRANSFER * STRIDE)
        for place, packet in enumerate(some):
            room[place * STRIDE : place * STRIDE + len(packet)] = packet
        filled.append((memoryview(room), [len(packet) for packet in some]))
    return filled
