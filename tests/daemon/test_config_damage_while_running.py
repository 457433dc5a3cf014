"""A running service through a thousand random damages of its config file."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from touchd.config.load import load_config
from touchd.errors import TouchdError
from touchd.service import Service

# No TUIO output: a damaged address could send datagrams to strangers.
WHOLE = """\
source: {{kind: recording, path: {path}}}
camera: {{fx: 580.0, fy: 580.0}}
calibration:
  frames: 20
  give_up_s: 9
area:
  corners_px: [[60, 40], [580, 44], [570, 430], [66, 424]]
touch:
  near_mm: 4
  far_mm: auto
  shell: {{threshold: 0.6, keep_threshold: 0.3}}
tracking:
  stall_ms: 200
  gate_mm: 40
outputs:
  - events: {{path: "out.jsonl"}}
"""
BITS = ("", "", " ", "\n", "0", "1", "9", ".", "-", ":", "{", "}", "[", "]", ",", "#", '"', "auto", "\t", "é", "\x00")

edits = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 3), st.sampled_from(BITS)), min_size=1, max_size=3
)


def damaged(whole: str, blows: list[tuple[float, int, str]]) -> str:
    for place, length, bit in blows:
        at = int(place * len(whole))
        whole = whole[:at] + bit + whole[at + length :]
    return whole


@pytest.fixture
def service(short_recording: Path, tmp_path: Path) -> Iterator[Service]:
    (tmp_path / "touchd.yaml").write_text(WHOLE.format(path=short_recording))
    service = Service(tmp_path / "touchd.yaml", tmp_path / "state")
    service.start()
    yield service
    service.stop()


def test_after_each_of_a_thousand_damages_the_old_config_or_a_valid_new_one_is_in_force(
    service: Service, short_recording: Path, tmp_path: Path
) -> None:
    path = tmp_path / "touchd.yaml"
    whole = WHOLE.format(path=short_recording)
    counts = {"refused": 0, "used": 0}

    @settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck), database=None)
    @given(edits)
    def damage(blows: list[tuple[float, int, str]]) -> None:
        path.write_text(damaged(whole, blows), encoding="utf-8")
        before, refusal = service.config, None
        try:
            service.reload()
        except TouchdError as error:
            refusal = str(error)
        counts["used" if refusal is None else "refused"] += 1
        assert refusal != ""
        assert service.problem == refusal
        assert service.config == (load_config(path) if refusal is None else before)
        assert not service.daemon.stopping.is_set()

    damage()
    assert min(counts.values()) >= 20, counts
    path.write_text(whole)
    service.reload()
    assert service.config == load_config(path)
