import errno

import pytest

from virtual_kinect.desk import claimed, error_of, plugged, start
from virtual_kinect.faults import Faults
from virtual_kinect.isochronous import IsochronousQueue
from virtual_kinect.model import Handle


def test_transfers_in_flight_follow_each_other_and_end_when_their_time_has_come() -> None:
    there = plugged()
    queue = IsochronousQueue(claimed(there), 0x82, there.clock)
    start(there.camera)
    queue.submit(1, 32, 32 * 1920)
    queue.submit(2, 32, 32 * 1920)
    assert queue.take() is None
    there.clock.advance(64)
    first = queue.take()
    assert first
    assert (first.key, first.error, len(first.packets)) == (1, 0, 32)
    assert queue.take() is None
    there.clock.advance(1)
    second = queue.take()
    assert second
    sent = [packet[5] for packet in first.packets + second.packets if packet]
    assert sent == list(range(len(sent)))


@pytest.mark.parametrize("patient", [False, True])
def test_a_late_program_loses_packets_unless_the_camera_is_patient(patient: bool) -> None:
    there = plugged()
    queue = IsochronousQueue(claimed(there), 0x82, there.clock, patient=patient)
    start(there.camera)
    sequence: list[int] = []
    for _ in range(3):
        queue.submit(1, 32, 32 * 1920)
        there.clock.advance(80)
        finished = queue.take()
        assert finished
        sequence += [packet[5] for packet in finished.packets if packet]
    assert (sequence == list(range(len(sequence)))) is patient


def test_a_cancelled_transfer_is_given_back_and_one_that_has_ended_cannot_be_cancelled() -> None:
    there = plugged()
    queue = IsochronousQueue(claimed(there), 0x82, there.clock)
    queue.submit(1, 32, 32 * 1920)
    queue.cancel(1)
    finished = queue.take()
    assert finished
    assert (finished.key, finished.error, len(queue)) == (1, errno.ENOENT, 0)
    assert error_of(lambda: queue.cancel(1)) == errno.EINVAL


def test_all_transfers_end_when_the_kinect_is_pulled_out_at_a_packet() -> None:
    there = plugged()
    queue = IsochronousQueue(claimed(there), 0x82, there.clock)
    there.camera.faults = Faults(unplug_before_packet=40)
    start(there.camera)
    for key in range(3):
        queue.submit(key, 32, 32 * 1920)
    there.clock.advance(200)
    ends = [queue.take() for _ in range(3)]
    assert [end and end.error for end in ends] == [0, errno.ENODEV, errno.ENODEV]
    assert error_of(lambda: queue.submit(9, 32, 32 * 1920)) == errno.ENODEV


def test_memory_for_transfers_runs_out_and_comes_back() -> None:
    there = plugged()
    there.camera.faults = Faults(iso_memory_bytes=2 * 61_440)
    queue = IsochronousQueue(claimed(there), 0x82, there.clock)
    queue.submit(1, 32, 61_440)
    queue.submit(2, 32, 61_440)
    assert error_of(lambda: queue.submit(3, 32, 61_440)) == errno.ENOMEM
    queue.cancel(1)
    queue.submit(3, 32, 61_440)


def test_a_silent_camera_accepts_everything_and_sends_nothing() -> None:
    there = plugged()
    there.camera.faults = Faults(silent=True)
    start(there.camera)
    assert there.camera.iso_packets(0x82, 1, 8000) == [b""] * 8000


def test_a_transfer_needs_the_claim() -> None:
    there = plugged()
    queue = IsochronousQueue(Handle(there.camera), 0x82, there.clock)
    assert error_of(lambda: queue.submit(1, 32, 61_440)) == errno.ENOENT
