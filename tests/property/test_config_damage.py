from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from touchd.config.load import DEFAULTS, load_config, parse_config
from touchd.config.schema import Config
from touchd.config.show import effective_yaml
from touchd.errors import ConfigError

WHOLE = b"""\
source: {kind: kinect, serial: "0123"}
calibration:
  frames: 120      # enough
  on_start: always
area:
  corners_px: [[60, 40], [580, 44], [570, 430], [66, 424]]
  size_mm: [800, 600]
touch:
  near_mm: 4
  far_mm: auto
  shell: {threshold: 0.6, keep_threshold: 0.3}
tracking:
  stall_ms: 200
outputs:
  - tuio:
      to: ["127.0.0.1:3333", '[::1]:3334']
  - events: {path: "out.jsonl"}
"""

HOSTILE = (
    *(bytes([character]) for character in b"\x00\t\n\r\x1b -:,[]{}#&*!|>'\"%@`?~<=\\0123456789eE.\x85\xff"),
    "\u2028".encode(),
    "\ufeff".encode(),
    "\U0001f590".encode(),
    b"\n---\n",
    b"...\n",
    b"<<: *a",
    b"&a ",
    b"*a",
    b"!!python/object ",
    b"!!int ",
    b"%YAML 9.9\n",
    b'"\\UFFFFFFFF"',
    b'"\\ud800"',
    b"[" * 3000,
    b"{a: " * 3000,
    b"- " * 3000,
    b"? " * 3000,
    b"9" * 5000,
    b"1e999",
    b".nan",
    b"null",
    b"auto",
    b"\n  stall_ms: 99\n",
    b"\ntouch:\n",
    b"- tuio:\n",
)

MILD = (b"", b" ", b"  ", b"\n", b"# ", b"0", b"1", b"2", b"7", b".5", b"e1", b"'", b"x")

places = st.integers(0, len(WHOLE))
slips = st.tuples(places, st.integers(0, 1), st.sampled_from(MILD))
blows = st.tuples(
    places,
    st.one_of(st.integers(0, 3), places),
    st.one_of(st.sampled_from(HOSTILE), st.binary(max_size=8), st.text(max_size=8).map(str.encode)),
)
damages = st.one_of(
    st.lists(slips, min_size=1, max_size=1), st.lists(slips, max_size=2), st.lists(st.one_of(slips, blows), max_size=4)
)
repeated_lines = st.lists(st.integers(0, 30), max_size=1)


def damaged(edits: list[tuple[int, int, bytes]], repeated: list[int]) -> bytes:
    """Repeat lines elsewhere, then at each place take some bytes out and put others in."""
    lines = WHOLE.splitlines(keepends=True)
    for line in repeated:
        lines.insert((line * 7) % len(lines), lines[line % len(lines)])
    content = b"".join(lines)
    for start, length, piece in edits:
        content = content[:start] + piece + content[start + length :]
    return content


def assert_tells_people_what_is_wrong(message: str) -> None:
    assert message.endswith("the config was not used.")
    assert "pydantic" not in message
    message.encode()


@settings(max_examples=1000, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(edits=damages, repeated=repeated_lines)
def test_a_damaged_file_is_a_valid_config_or_one_config_error(
    tmp_path: Path, edits: list[tuple[int, int, bytes]], repeated: list[int]
) -> None:
    path = tmp_path / "touchd.yaml"
    path.write_bytes(damaged(edits, repeated))

    try:
        config = load_config(path)
    except ConfigError as error:
        assert_tells_people_what_is_wrong(str(error))
    else:
        assert parse_config(effective_yaml(config, DEFAULTS), str(path)) == config


@settings(max_examples=300, deadline=None)
@given(st.text())
def test_any_text_is_a_valid_config_or_one_config_error(text: str) -> None:
    try:
        config = parse_config(text, "touchd.yaml")
    except ConfigError as error:
        assert_tells_people_what_is_wrong(str(error))
    else:
        assert config == Config()


def test_the_undamaged_file_is_valid() -> None:
    assert parse_config(WHOLE.decode(), "touchd.yaml").calibration.frames == 120


@pytest.mark.parametrize("piece", HOSTILE)
def test_every_hostile_piece_alone_is_survived(tmp_path: Path, piece: bytes) -> None:
    path = tmp_path / "touchd.yaml"
    for content in (piece, b"touch: " + piece, b"source: {path: " + piece + b"}", WHOLE + piece):
        path.write_bytes(content)
        try:
            config = load_config(path)
        except ConfigError as error:
            assert_tells_people_what_is_wrong(str(error))
        else:
            assert isinstance(config, Config)
