import re
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from touchd.status.prometheus import prometheus

from statuses import FAILING, HEALTHY, SOURCE, TUIO

# The text format, from its description: a line is a comment, or a name, labels in braces, and a number.
_LABEL = r'[a-zA-Z_][a-zA-Z0-9_]*="(?:[^"\\\n]|\\\\|\\"|\\n)*"'
_SAMPLE = re.compile(
    r"(?P<name>[a-zA-Z_:][a-zA-Z0-9_:]*)"
    rf"(?:\{{(?P<labels>{_LABEL}(?:,{_LABEL})*)\}})?"
    r" (?P<value>[+-]?(?:\d+(?:\.\d*)?(?:[eE][+-]?\d+)?))"
)
_UNITS = ("seconds", "bytes", "meters", "ratio", "degrees", "per_second")


def scraped(page: str) -> dict[str, float]:
    """Samples by name and labels; asserts that each metric has HELP and TYPE before its samples, and only once."""
    assert page.endswith("\n")
    samples: dict[str, float] = {}
    declared: list[str] = []
    kind = ""
    for line in page.removesuffix("\n").split("\n"):
        if line.startswith("# HELP "):
            name, text = line.removeprefix("# HELP ").split(" ", 1)
            assert text
            assert name not in declared
            declared.append(name)
            kind = ""
        elif line.startswith("# TYPE "):
            name, kind = line.removeprefix("# TYPE ").split(" ")
            assert name == declared[-1]
            assert kind == ("counter" if name.endswith("_total") else "gauge")
        else:
            found = _SAMPLE.fullmatch(line)
            assert found is not None, line
            assert found["name"] == declared[-1]
            assert kind
            key = found["name"] + (f"{{{found['labels']}}}" if found["labels"] else "")
            assert key not in samples
            samples[key] = float(found["value"])
    return samples


def test_prometheus_scrapes_the_figures_in_base_units() -> None:
    source = replace(SOURCE, packet_loss=0.3)
    samples = scraped(prometheus(replace(HEALTHY, outputs=(TUIO, FAILING), source=source)))
    assert samples['touchd_frame_latency_seconds{statistic="p99"}'] == pytest.approx(0.0031)
    assert samples['touchd_state{state="tracking"}'] == 1
    assert sum(value for key, value in samples.items() if key.startswith("touchd_state{")) == 1
    assert samples["touchd_surface_distance_meters"] == pytest.approx(0.8214)
    assert samples["touchd_frames_total"] == 241201
    assert samples["touchd_source_packet_loss_ratio"] == 0.3
    assert samples["touchd_resident_memory_bytes"] == 86_400_000
    assert samples['touchd_area_origin{origin="alignment"}'] == 1
    labels = 'output="1",name="tuio to a:3333, b:3333",destination="b:3333",destination_index="1"'
    assert samples[f"touchd_output_failed_total{{{labels}}}"] == 7
    assert samples['touchd_output_sent_total{output="0",name="tuio to 127.0.0.1:3333"}'] == 20314


def test_prometheus_gets_no_sample_for_what_is_not_known() -> None:
    bare = replace(HEALTHY, state=None, memory_bytes=None, surface=None, area=None, outputs=())
    samples = scraped(prometheus(replace(bare, source=replace(SOURCE, fps=None, latency_p99_ms=None))))
    assert "touchd_frames_per_second" not in samples
    assert "touchd_source_packet_loss_ratio" not in samples
    assert "touchd_resident_memory_bytes" not in samples
    assert [key for key in samples if re.search('touchd_surface|touchd_area|touchd_output|"p99"', key)] == []
    assert sum(value for key, value in samples.items() if key.startswith("touchd_state{")) == 0


@given(name=st.text(), sent=st.integers(0, 10**15), fps=st.none() | st.floats(0, 1e6))
@settings(deadline=None)
def test_prometheus_can_read_whatever_names_and_figures_there_are(name: str, sent: int, fps: float | None) -> None:
    status = replace(
        HEALTHY, source=replace(SOURCE, name=name, fps=fps), outputs=(replace(TUIO, sent=sent, name=name),)
    )
    samples = scraped(prometheus(status))
    assert sent in samples.values()
    escaped = name.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    assert any(f'source="{escaped}"' in key for key in samples)
