"""Isochronous transfers in flight, as a host controller keeps them. Standard library alone."""

import errno
from collections import deque
from dataclasses import dataclass

from virtual_kinect.model import Clock, Handle, UsbError


@dataclass(frozen=True, slots=True)
class Transfer:
    """A submitted transfer: one packet in each of ``packets`` microframes from ``first`` on."""

    key: int
    first: int
    packets: int
    length: int


@dataclass(frozen=True, slots=True)
class Finished:
    """A transfer that has ended: ``error`` is 0, ENOENT (cancelled) or ENODEV (unplugged)."""

    key: int
    packets: tuple[bytes, ...] = ()
    error: int = 0


class IsochronousQueue:
    """The transfers of one endpoint of an opened device, in the order of submission.

    They follow each other without a gap. Whatever the device sends while none is in flight is lost, as in reality;
    but if ``patient``, the device waits for late programs, so that only those packets are lost that faults take.
    """

    def __init__(self, handle: Handle, endpoint: int, clock: Clock, *, patient: bool = False) -> None:
        self._handle = handle
        self._endpoint = endpoint
        self._clock = clock
        self._patient = patient
        self._end_of_last = 0
        self._flying: deque[Transfer] = deque()
        self._finished: deque[Finished] = deque()

    def __len__(self) -> int:
        """Return how many transfers have not been given back."""
        return len(self._flying) + len(self._finished)

    def submit(self, key: int, packets: int, length: int) -> None:
        """Queue a transfer of ``length`` bytes in all; UsbError if it cannot be."""
        self._handle.device.check()
        self._handle.need_claim()
        self._handle.hold_iso_memory(length)
        soon = self._clock.microframe() + 1
        first = self._end_of_last if self._patient and self._end_of_last else max(self._end_of_last, soon)
        self._end_of_last = first + packets
        self._flying.append(Transfer(key, first, packets, length))

    def cancel(self, key: int) -> None:
        """End a transfer with ENOENT; UsbError with EINVAL if it is not in flight."""
        for transfer in self._flying:
            if transfer.key == key:
                self._end(transfer, Finished(key, error=errno.ENOENT))
                return
        raise UsbError(errno.EINVAL)

    def next_end(self) -> int | None:
        """Return the microframe after which the next transfer ends, None without any."""
        if self._finished:
            return self._clock.microframe()
        return self._flying[0].first + self._flying[0].packets if self._flying else None

    def take(self) -> Finished | None:
        """Return the next transfer that has ended by now, None if there is none."""
        if not self._finished and self._flying:
            self._complete(self._flying[0])
        return self._finished.popleft() if self._finished else None

    def _complete(self, transfer: Transfer) -> None:
        device = self._handle.device
        try:
            device.check()
            if transfer.first + transfer.packets > self._clock.microframe():
                return
            packets = device.iso_packets(self._endpoint, transfer.first, transfer.packets)
        except UsbError as error:
            self._end(transfer, Finished(transfer.key, error=error.errno))
        else:
            self._end(transfer, Finished(transfer.key, tuple(packets)))

    def _end(self, transfer: Transfer, finished: Finished) -> None:
        self._flying.remove(transfer)
        self._handle.free_iso_memory(transfer.length)
        self._finished.append(finished)
