"""What is asked of a running service while its worker is busy."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from touchd.model import TouchFrame
from touchd.pipeline import Pipeline
from touchd.ready import PipelineSettings, Ready
from touchd.service import Service

from clients.harness import PATIENCE_S
from daemon.running import wait_until

Edit = Callable[[int], Path]

CONFIG = """\
source: {{kind: recording, path: {path}}}
calibration: {{frames: 20}}
area:
  corners_px: [[{left}, 40], [580, 44], [570, 430], [66, 424]]
outputs:
  - events: {{path: "{events}"}}
"""


@pytest.fixture
def edit(short_recording: Path, tmp_path: Path) -> Edit:
    """Return what writes the config file, with the place of one corner."""

    def write(left: int) -> Path:
        path = tmp_path / "touchd.yaml"
        path.write_text(CONFIG.format(path=short_recording, left=left, events=tmp_path / "out.jsonl"))
        return path

    return write


@pytest.fixture
def service(edit: Edit, tmp_path: Path) -> Iterator[Service]:
    service = Service(edit(60), tmp_path / "state")
    service.start()
    wait_until(lambda: service.daemon.pipeline.ready is not None)
    yield service
    service.stop()


@contextmanager
def worker_busy(service: Service) -> Iterator[None]:
    busy, free = threading.Event(), threading.Event()

    def be_busy() -> None:
        busy.set()
        free.wait()

    service.daemon.ask(be_busy)
    assert busy.wait(PATIENCE_S)
    try:
        yield
    finally:
        free.set()


def worker_idle(service: Service) -> None:
    """Wait until the worker has come to what was asked of it so far."""
    done = threading.Event()
    service.daemon.ask(done.set)
    assert done.wait(PATIENCE_S)


def left_corner(service: Service) -> float:
    ready = service.daemon.pipeline.ready
    assert ready is not None
    return ready.corners.corners_px[0][0]


def test_of_many_edits_only_the_last_is_put_in_force_where_the_worker_was_busy(
    service: Service, edit: Edit, monkeypatch: pytest.MonkeyPatch
) -> None:
    adopted: list[float] = []
    adopt = Pipeline.adopt

    def noted(self: Pipeline, settings: PipelineSettings, ready: Ready | None) -> None:
        adopt(self, settings, ready)
        adopted.append(left_corner(service))

    monkeypatch.setattr(Pipeline, "adopt", noted)
    with worker_busy(service):
        for left in (62, 64, 66, 68):
            edit(left)
            service.reload()
    worker_idle(service)
    assert adopted == [68.0]


def test_an_alignment_that_ends_while_the_worker_is_busy_leaves_the_area_as_it_was(service: Service) -> None:
    given: list[TouchFrame] = []
    with worker_busy(service):
        service.begin_aligning(given.append)
        service.end_aligning()
    worker_idle(service)
    assert left_corner(service) == 60.0
    frames = service.daemon.metrics().frames
    wait_until(lambda: service.daemon.metrics().frames > frames + 1)
    assert given == []


def test_an_edit_before_an_alignment_is_in_force_after_it(service: Service, edit: Edit) -> None:
    with worker_busy(service):
        edit(64)
        service.reload()
        service.begin_aligning(lambda _: None)
    worker_idle(service)
    assert left_corner(service) == 0.0
    service.end_aligning()
    worker_idle(service)
    assert left_corner(service) == 64.0
