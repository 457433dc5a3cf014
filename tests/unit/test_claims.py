import os

import pytest
from touchd.claims import DestinationClaims

HERE = f"127.0.0.1:{os.getpid()}"
THERE = f"127.0.0.2:{os.getpid()}"


@pytest.fixture
def first() -> DestinationClaims:
    return DestinationClaims()


@pytest.fixture
def second() -> DestinationClaims:
    return DestinationClaims()


def test_a_destination_that_another_touchd_sends_to_is_named(
    first: DestinationClaims, second: DestinationClaims
) -> None:
    assert first.hold([HERE]) == []
    assert second.hold([THERE, HERE]) == [HERE]
    first.release()
    second.release()


def test_what_is_no_longer_wanted_is_free_for_others(first: DestinationClaims, second: DestinationClaims) -> None:
    first.hold([HERE, THERE])
    assert first.hold([THERE]) == []
    assert second.hold([HERE]) == []
    first.release()
    assert second.hold([HERE, THERE]) == []
    second.release()


def test_claiming_the_same_again_is_no_conflict_with_oneself(first: DestinationClaims) -> None:
    first.hold([HERE])
    assert first.hold([HERE]) == []
    first.release()
