"""The depth stream's packets put together to frames, whatever is lost or damaged on the way.

A packet has a header of 12 bytes: "RB", a pad byte, a flag, a byte, a sequence number (uint8, over all frames), two
bytes, and the device's time as a little-endian uint32 at 60 MHz. A frame is 242 packets: a start, 240 in the middle, an
end. (Source: the OpenKinect project.) There is no checksum. So these cannot be noticed: a payload whose bytes were
changed but not their number; a header changed into just the one that was due; exactly 128 frames (4.3 s) lost right
behind a start, for which numbers and places are the same again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from struct import Struct

from touchd.model import Image16
from touchd.sources.kinect.unpack import PACKETS_PER_FRAME, PictureBuffer, payload_bytes

HEADER_BYTES = 12
START, MIDDLE, END = 0x71, 0x72, 0x75
TICKS_WRAP = 1 << 32
TICKS_PER_FRAME = 2_002_200  # 33.37 ms

_HEADER = Struct("<2sxBxBxxI")
_MAGIC = b"RB"
_FLAG_AT = 3
_FLAGS = (START, *[MIDDLE] * (PACKETS_PER_FRAME - 2), END)
_SIZES = tuple(HEADER_BYTES + payload_bytes(slot) for slot in range(PACKETS_PER_FRAME))
_LAST = PACKETS_PER_FRAME - 1
_MIDDLE_BYTES = HEADER_BYTES + payload_bytes(1)
_LARGEST_GAP = 5
_REPEATED = 255  # one behind the sequence number that is due
_UNSYNCHRONISED = -1  # no sequence number
_LARGEST_STEP_TICKS = TICKS_PER_FRAME // 2  # from one packet to the next within a frame
_DISTRUSTED_AFTER = 8  # frames in a row


@dataclass(frozen=True, slots=True)
class DepthPacketFrame:
    """A frame: ``raw`` (480, 640) uint16 of 11-bit shift, read-only and its owner's to keep.

    ``ticks``: the device's time in its last packet that came, as uint32 at 60 MHz. ``missing``: which of its 242
    packets are missing, rising; their pixels in ``raw`` are 2047, as those without a reading are.
    """

    ticks: int
    missing: tuple[int, ...]
    raw: Image16


@dataclass(slots=True)
class PacketCounts:
    """What became of packets and frames so far. Written by the thread that feeds the packets; any may read."""

    damaged: int = 0  # packets without a header of ours
    skipped: int = 0  # packets that came while a frame's start was waited for
    lost: int = 0  # packets that never came, as far as the sequence tells
    repeated: int = 0  # packets that came twice
    misfits: int = 0  # packets whose payload was too short or too long
    resynchronised: int = 0  # how often the sequence or the flags did not fit
    whole: int = 0  # frames
    partial: int = 0  # frames with packets missing
    dropped: int = 0  # frames begun that came to nothing


def frames_missed(earlier_ticks: int, later_ticks: int) -> int:
    """Return how many frames the device took between two frames of these times, at most 70 s apart."""
    elapsed = (later_ticks - earlier_ticks) % TICKS_WRAP
    return max(0, round(elapsed / TICKS_PER_FRAME) - 1)


def last_end(transfer: memoryview, lengths: Sequence[int], stride: int) -> int | None:
    """Return the place of the last packet in a transfer that says that it ends a frame; None without one.

    ``transfer`` and ``stride`` as in :meth:`PacketAssembler.feed_transfer`.
    """
    octets = transfer.cast("B")
    for place in range(len(lengths) - 1, -1, -1):
        if lengths[place] >= HEADER_BYTES and octets[place * stride + _FLAG_AT] == END:
            return place
    return None


class PacketAssembler:
    """Turns packets into frames. Use it from one thread.

    Frames come out whole, or partial and saying so, or not at all:

    - A gap of up to 5 in the sequence leaves those packets out. If it reaches over a frame's end, the frame ends as
      partial, and so it does, whatever is missing, at a start where the sequence has one.
    - A larger gap, or a flag at a place where it cannot be, gives the frame up: nothing vouches for the places any
      more. The next start begins anew.
    - A packet that comes twice with different payloads counts as missing.
    - Where the device's time leaps within a frame, parts of two frames met at the same sequence numbers, and the frame
      is given up. The start's time is left out: it is described as 0, or as something else than a time. Should the
      time leap in many frames in a row, this device does not count it that way, and its leaps are not minded.
    """

    def __init__(self) -> None:
        self.counts = PacketCounts()
        self._picture = PictureBuffer()
        self._sequence = _UNSYNCHRONISED  # of the packet that is due
        self._leaping_frames = 0  # in a row
        # Of the frame at hand:
        self._slot = 0  # which of its packets is due
        self._missing: list[int] = []
        self._ticks: int | None = None  # the device's time in its last packet that came, but for its start
        self._leaps = False

    def feed_transfer(self, transfer: memoryview, lengths: Sequence[int], stride: int) -> list[DepthPacketFrame]:
        """Take a transfer's packets; return the frames that they complete, oldest first.

        ``transfer``: its bytes, with a packet at every multiple of ``stride``. ``lengths``: how many bytes of each
        came; 0 for none and for those that the host found faulty.
        """
        octets = transfer.cast("B")
        frames = []
        place = 0
        while (place := self._take_middles(octets, lengths, place, stride)) < len(lengths):
            start = place * stride
            frame = self.feed(octets[start : start + lengths[place]])
            if frame is not None:
                frames.append(frame)
            place += 1
        self._picture.unpack_ahead(self._slot)
        return frames

    def _take_middles(self, octets: memoryview, lengths: Sequence[int], place: int, stride: int) -> int:
        """Store packets of the middle of a frame as long as each is the one due; return the place of the first other.

        Nearly all packets are such, and a call for each of them would cost 1 % of a core.
        """
        slot, sequence, last_ticks = self._slot, self._sequence, self._ticks
        if last_ticks is None:
            return place
        while place < len(lengths) and slot < _LAST:
            length = lengths[place]
            if length:
                start = place * stride
                magic, flag, number, ticks = _HEADER.unpack_from(octets, start)
                step_ticks = ticks - last_ticks
                if number != sequence or flag != MIDDLE or length != _MIDDLE_BYTES or magic != _MAGIC:
                    break
                if not 0 <= step_ticks <= _LARGEST_STEP_TICKS:
                    break
                self._picture.put(slot, octets[start + HEADER_BYTES : start + _MIDDLE_BYTES])
                slot, sequence, last_ticks = slot + 1, (sequence + 1) & 0xFF, ticks
            place += 1
        self._slot, self._sequence, self._ticks = slot, sequence, last_ticks
        return place

    def feed(self, packet: memoryview | bytes) -> DepthPacketFrame | None:
        """Take a packet; return the frame that it completes, or whose end it shows to be missing."""
        if len(packet) < HEADER_BYTES:
            self.counts.damaged += len(packet) > 0
            return None
        magic, flag, sequence, ticks = _HEADER.unpack_from(packet)
        if magic != _MAGIC:
            self.counts.damaged += 1
            return None
        if sequence == self._sequence and flag == _FLAGS[self._slot]:
            return self._take(packet, ticks)
        return self._reconcile(packet, flag, sequence, ticks)

    def _reconcile(self, packet: memoryview | bytes, flag: int, sequence: int, ticks: int) -> DepthPacketFrame | None:
        """Take a packet that is not the one due; return the frame that it completes or ends."""
        if self._sequence == _UNSYNCHRONISED:
            return self._wait_for_start(packet, flag, sequence, ticks)
        gap = (sequence - self._sequence) % 256
        if gap == _REPEATED and flag == _FLAGS[self._slot - 1]:  # before a start: the end
            self._compare_repeated(packet)
            return None
        place = self._slot + gap
        slot = place % PACKETS_PER_FRAME
        if (gap > _LARGEST_GAP and place != PACKETS_PER_FRAME) or flag != _FLAGS[slot]:
            self._resynchronise()
            return self._wait_for_start(packet, flag, sequence, ticks)
        ended = self._skip(gap)
        return self._take(packet, ticks) or ended

    def _take(self, packet: memoryview | bytes, ticks: int) -> DepthPacketFrame | None:
        """Store the packet that is due; return the frame if it was its last."""
        slot = self._slot
        if len(packet) == _SIZES[slot]:
            self._picture.put(slot, packet[HEADER_BYTES:])
        else:
            self._missing.append(slot)
            self.counts.misfits += 1
        if slot > 0:
            step_ticks = 0 if self._ticks is None else (ticks - self._ticks) % TICKS_WRAP
            self._leaps = self._leaps or step_ticks > _LARGEST_STEP_TICKS
            self._ticks = ticks
        self._sequence = (self._sequence + 1) % 256
        self._slot = slot + 1
        return self._finish() if self._slot == PACKETS_PER_FRAME else None

    def _skip(self, gap: int) -> DepthPacketFrame | None:
        """Leave out as many packets; return the frame that ends by it."""
        self.counts.lost += gap
        self._sequence = (self._sequence + gap) % 256
        place, ended = self._slot + gap, None
        if place >= PACKETS_PER_FRAME:
            if self._slot > 0:
                self._missing.extend(range(self._slot, PACKETS_PER_FRAME))
                ended = self._finish()
            self._begin()
            place -= PACKETS_PER_FRAME
        self._missing.extend(range(self._slot, place))
        self._slot = place
        return ended

    def _compare_repeated(self, packet: memoryview | bytes) -> None:
        """Where two packets claim the last place and differ, at least one of them is not what it says."""
        self.counts.repeated += 1
        last = self._slot - 1
        if last >= 0 and last not in self._missing and not self._picture.holds(last, packet[HEADER_BYTES:]):
            self._missing.append(last)

    def _wait_for_start(
        self, packet: memoryview | bytes, flag: int, sequence: int, ticks: int
    ) -> DepthPacketFrame | None:
        if flag != START:
            self.counts.skipped += 1
            return None
        self._sequence = sequence
        return self._take(packet, ticks)

    def _resynchronise(self) -> None:
        self.counts.resynchronised += 1
        self.counts.dropped += self._slot > 0
        self._sequence = _UNSYNCHRONISED
        self._begin()

    def _begin(self) -> None:
        self._slot = 0
        self._missing = []
        self._ticks = None
        self._leaps = False
        self._picture.begin()

    def _finish(self) -> DepthPacketFrame | None:
        ticks, missing = self._ticks or 0, tuple(self._missing)
        self._leaping_frames = self._leaping_frames + 1 if self._leaps else 0
        if 0 < self._leaping_frames < _DISTRUSTED_AFTER:
            self.counts.dropped += 1
            self._begin()
            return None
        self.counts.partial += len(missing) > 0
        self.counts.whole += not missing
        raw = self._picture.finish(missing)
        self._begin()
        return DepthPacketFrame(ticks, missing, raw)
