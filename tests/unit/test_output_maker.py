"""From the config's outputs to those that run: which are made anew when the config changes, and what each is sent."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from touchd.assemble import OutputMaker
from touchd.config.load import parse_config
from touchd.config.schema import Config
from touchd.model import Cursor, Hover, State, TableObject, TouchFrame
from touchd.outputs.output import Output

from clients.bundles import Mailbox, read_bundle


@pytest.fixture
def boxes() -> Iterator[list[Mailbox]]:
    with Mailbox() as one, Mailbox() as two, Mailbox() as three:
        yield [one, two, three]


def config_to(boxes: list[Mailbox], rest: str = "") -> Config:
    profiles = zip(boxes, ("2Dcur", "25Dcur", "2Dblb"), strict=True)
    items = (f'{{tuio: {{to: ["{box.destination}"], profile: {profile}}}}}' for box, profile in profiles)
    return parse_config(f"outputs: [{', '.join(items)}]\n{rest}", "touchd.yaml")


def everything() -> TouchFrame:
    phone = TableObject(1, ((0.25, 0.25), (0.75, 0.25), (0.75, 0.5), (0.25, 0.5)), 8.0)
    cursor = Cursor(1, 0.5, 0.25, 0.0, 0.0, 0.0, 4.0, 60.0, 0.0)
    return TouchFrame(0, 0, State.TRACKING, (cursor,), hovers=(Hover(1, 0.25, 0.75, 20.0),), objects=(phone,))


@contextmanager
def made(maker: OutputMaker, config: Config) -> Iterator[list[Output]]:
    """Yield the outputs after a frame of everything; at the end they say goodbye."""
    outputs = maker.outputs(config)
    for output in outputs:
        output.publish(everything(), 0)
    yield outputs
    for output in outputs:
        output.close()


def test_each_port_gets_its_own_profile_alone(boxes: list[Mailbox]) -> None:
    with made(OutputMaker("main", 0), config_to(boxes)):
        (touches,), (fingertips,), (blobs,) = (box.take() for box in boxes)
    assert len(read_bundle(touches).alive) == 1
    assert [values[2] for values in read_bundle(fingertips, "25Dcur").sets.values()] == [0.0, 0.5]
    assert [values[:2] for values in read_bundle(blobs, "2Dblb").sets.values()] == [(0.5, 0.375)]


def test_another_greatest_height_makes_the_fingertips_output_anew_and_no_other(boxes: list[Mailbox]) -> None:
    maker = OutputMaker("main", 0)
    with made(maker, config_to(boxes)) as before:
        boxes[1].take()
        with made(maker, config_to(boxes, "tracking: {hover_mm: 25}\n")) as after:
            assert [old is new for old, new in zip(before, after, strict=True)] == [True, False, True]
            (sent,) = boxes[1].take()
    assert [values[2] for values in read_bundle(sent, "25Dcur").sets.values()] == [0.0, pytest.approx(0.8)]


def test_a_port_that_changes_its_profile_goes_on_counting_its_frames(boxes: list[Mailbox]) -> None:
    maker = OutputMaker("main", 0)
    with made(maker, config_to(boxes)):
        first = read_bundle(boxes[0].take()[0])
    boxes[0].take()
    with made(maker, config_to(boxes[1:] + boxes[:1])):
        second = read_bundle(boxes[0].take()[0], "2Dblb")
    assert second.fseq > first.fseq
