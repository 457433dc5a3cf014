"""What can be made to go wrong with the virtual Kinect. Standard library alone, for Debian's own Python."""

import zlib
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any


class Reply(StrEnum):
    """How the camera answers commands."""

    PROPER = "proper"
    EMPTY = "empty"  # 0 bytes, for ever
    NOT_READY = "not-ready"  # 512 bytes, for ever
    WRONG_TAG = "wrong-tag"
    WRONG_COMMAND = "wrong-command"
    WRONG_MAGIC = "wrong-magic"


@dataclass(frozen=True, slots=True)
class Faults:
    """The faults of one device. Packets are numbered from 0 at the moment the stream is switched on.

    ``drop``, ``corrupt`` (one byte of the header that matters is inverted) and ``truncate`` (half of the packet
    arrives) are shares of all packets, drawn from ``seed`` by the packet's number alone; the tuples name packets.
    ``silent`` accepts everything and sends nothing. Each ``*_errno`` is what that operation fails with.
    """

    seed: int = 0
    drop: float = 0.0
    corrupt: float = 0.0
    truncate: float = 0.0
    drop_packets: tuple[int, ...] = ()
    corrupt_packets: tuple[int, ...] = ()
    truncate_packets: tuple[int, ...] = ()
    silent: bool = False
    reply: Reply = Reply.PROPER
    polls_before_reply: int = 1  # how often a reply is asked for in vain, as real ones are
    length_before_reply: int = 0  # what comes until then: 0 or 512 bytes
    open_errno: int | None = None
    claim_errno: int | None = None
    control_errno: int | None = None
    iso_memory_bytes: int = 16 * 2**20  # usbfs_memory_mb; beyond it a submit fails with ENOMEM
    unplug_after_controls: int | None = None  # counted from when these faults were set
    unplug_before_packet: int | None = None

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    @staticmethod
    def from_json(values: dict[str, Any]) -> "Faults":
        proper: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
        }
        return Faults(**proper | {"reply": Reply(values.get("reply", Reply.PROPER))})

    def damaged(self, number: int, packet: bytes) -> bytes:
        """Return what arrives of packet ``number``; nothing where it is lost."""
        if self.silent or number in self.drop_packets or self._hit("drop", self.drop, number):
            return b""
        if number in self.corrupt_packets or self._hit("corrupt", self.corrupt, number):
            at = (0, 1, 3, 5)[int(self._draw("byte", number) * 4)]  # magic, magic, flag, sequence
            packet = packet[:at] + bytes((packet[at] ^ 0xFF,)) + packet[at + 1 :]
        if number in self.truncate_packets or self._hit("truncate", self.truncate, number):
            packet = packet[: len(packet) // 2]
        return packet

    def _hit(self, what: str, share: float, number: int) -> bool:
        return share > 0 and self._draw(what, number) < share

    def _draw(self, what: str, number: int) -> float:
        """Return a number in 0..1 that depends on nothing but the seed, the fault and the packet."""
        return zlib.crc32(f"{self.seed} {what} {number}".encode()) / 2**32
