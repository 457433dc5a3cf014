"""Transfers that end where frames do."""

from hypothesis import given
from hypothesis import strategies as st
from touchd.sources.kinect.pacing import MICROFRAMES_PER_FRAME, TransferSizes

MOST = 48


@given(
    phase=st.floats(0.0, MICROFRAMES_PER_FRAME),
    drift=st.floats(-2e-4, 2e-4),
    late=st.lists(st.integers(0, 1), min_size=60, max_size=60),
    flying=st.integers(4, 16),
)
def test_after_the_first_frames_a_transfer_ends_within_three_packets_of_every_frame(
    phase: float, drift: float, late: list[int], flying: int
) -> None:
    """The camera's clock differs from USB's by ``drift``, and a frame may end a microframe ``late``."""
    sizes = TransferSizes(MOST)
    ends = [round(phase + n * MICROFRAMES_PER_FRAME * (1.0 + drift)) + late[n] for n in range(60)]
    planned = [sizes.plan() for _ in range(flying)]
    boundaries, told = [], 0
    while told < len(ends) - 1:
        first, packets = planned.pop(0)
        boundaries.append(first + packets)
        while told < len(ends) and ends[told] < first + packets:
            sizes.ended(ends[told])
            told += 1
        planned.append(sizes.plan())
    for end in ends[6:-1]:
        assert min(boundary - (end + 1) for boundary in boundaries if boundary > end) <= 4


@given(ends=st.lists(st.integers(0, 100_000), max_size=30))
def test_transfers_follow_each_other_without_a_gap_and_fit_whatever_is_said_about_frames(ends: list[int]) -> None:
    sizes = TransferSizes(MOST)
    expected = 0
    for end in [*ends, None]:
        if end is not None:
            sizes.ended(end)
        for _ in range(8):
            first, packets = sizes.plan()
            assert first == expected
            assert 1 <= packets <= MOST
            expected += packets


def test_six_even_transfers_make_a_frame() -> None:
    sizes = TransferSizes(MOST)
    sizes.ended(100)
    counts = [sizes.plan()[1] for _ in range(30)]
    assert min(counts[6:]) >= 44
    assert max(counts[6:]) <= 46
