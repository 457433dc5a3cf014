import re

import pytest
from touchd.config.load import parse_config
from touchd.config.problems import MOST_SHOWN
from touchd.contacts.settings import BlobSettings
from touchd.errors import ConfigError

BLOBS = BlobSettings()

MISTAKES = [
    pytest.param(
        "outputs:\n",
        ["1:1: outputs: expected list items '- tuio:' or '- events:', or [] for no output, found nothing"],
        id="outputs with nothing below it",
    ),
    pytest.param(
        "outputs:\n  - {tuio: , events: {path: touches.jsonl}}\n  - events:\n",
        [
            "2:5: outputs: an output is one thing, tuio or events; found both; give each a '-' of its own",
            "3:5: outputs[1].events.path: missing; give a path",
        ],
        id="two outputs in one item, and an output without its file",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [600, 40], [60, 400], [600, 400]]\n",
        ["2:15: area.corners_px: the outline crosses itself; give top-left, top-right, bottom-right, bottom-left"],
        id="corners of which two are swapped",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [600, 40], [200, 150], [60, 400]]\n",
        [
            (
                "2:15: area.corners_px: the bottom-right corner dents the area inwards; "
                "give top-left, top-right, bottom-right, bottom-left"
            )
        ],
        id="a corner inside the others",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [60, 400], [200, 150], [600, 40]]\n",
        [
            (
                "2:15: area.corners_px: the bottom-right corner dents the area inwards; "
                "give top-left, top-right, bottom-right, bottom-left"
            )
        ],
        id="a corner inside the others, which run anticlockwise",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [300, 40], [600, 40], [60, 400]]\n",
        [
            (
                "2:15: area.corners_px: the top-right corner lies in a line with its neighbours; "
                "give top-left, top-right, bottom-right, bottom-left"
            )
        ],
        id="three corners in a line",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [600, 40], [600, 42], [60, 400]]\n",
        [
            (
                "2:15: area.corners_px: the top-right and bottom-right corners are 2 px apart;"
                " an area's sides are at least 8 px long"
            )
        ],
        id="two corners in one place",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [600, left], [600, 400]]\n",
        [
            "2:15: area.corners_px: expected four corners [u, v] in pixels from -1000 to 5000, found a list of 3",
            '2:32: area.corners_px: expected four corners [u, v] in pixels from -1000 to 5000, found "left"',
        ],
        id="three corners, and a word for a number",
    ),
    pytest.param(
        "area:\n  size_mm: [800]\n",
        [
            "1:1: area.corners_px: missing; give four corners [u, v] in pixels from -1000 to 5000",
            "2:12: area.size_mm: expected [width, height] in millimetres from 10 to 10000, found a list of 1",
        ],
        id="an area without corners",
    ),
    pytest.param(
        "touch:\n  far_mm: 14\n  shell: {delta_raw: 4}\n",
        ["2:3: touch.far_mm: set beside shell.delta_raw, which replaces it; remove one of the two"],
        id="two ways to say how thick the layer is",
    ),
    pytest.param(
        "touch:\n  shell:\n    threshold: 0.02\n",
        [
            (
                f"3:5: touch.shell.threshold: keep_threshold ({BLOBS.keep_threshold:g}) is above threshold (0.02);"
                " a touch would end as it begins; set keep_threshold to 0.02 or less"
            )
        ],
        id="a threshold below the one that keeps touches, which is left at its default",
    ),
    pytest.param(
        "touch:\n  min_area_mm2: 90000\n",
        [
            (
                f"2:3: touch.min_area_mm2: max_area_mm2 ({BLOBS.max_area_mm2:g}) is not above min_area_mm2 (90000);"
                " no contact could count"
            )
        ],
        id="areas that leave no room between them",
    ),
    pytest.param(
        "touch:\n  shell: {boxcar_px: 8}\n",
        ["2:22: touch.shell.boxcar_px: a window needs a middle pixel, so an odd number; found 8, take 9"],
        id="an even window",
    ),
    pytest.param(
        "source: {path: ''}\n",
        ["1:16: source.path: the path is empty; write a path, or remove the key"],
        id="an empty path",
    ),
    pytest.param(
        "touch:\n  near_mm:3\n",
        ["2:3: touch: expected keys below it, such as 'method:', found \"near_mm:3\"; put a space after the ':'"],
        id="no space after the colon",
    ),
    pytest.param(
        "touch:\n  near_mm:\n",
        ["2:3: touch.near_mm: expected auto, or millimetres from 0 to 100, found nothing"],
        id="no value after the colon",
    ),
    pytest.param(
        "- touch\n- tracking\n", ["1:1: expected keys such as 'touch:', found a list of 2"], id="a list at the top"
    ),
    pytest.param(
        "calibration:\n  frames: 300.5\ntracking:\n  stall_ms: true\n  gate_mm: .inf\n",
        [
            "2:11: calibration.frames: expected a whole number of frames from 10 to 10000, found 300.5",
            "4:13: tracking.stall_ms: expected milliseconds from 34 to 5000, found true",
            "5:12: tracking.gate_mm: expected millimetres from 1 to 500, found .inf",
        ],
        id="a fraction of a frame, and a truth for a time",
    ),
    pytest.param(
        "wibble: 1\n",
        [
            "1:1: wibble: unknown key; known here: version, source, camera, calibration, surface, area, "
            "touch, tracking, objects, outputs"
        ],
        id="an unknown key that resembles none",
    ),
    pytest.param(
        "touch:\n    near_mm: 3\n  far_mm: 4\n",
        ["3:3: this fits nothing above it; check the indentation, quotes and brackets of this line"],
        id="a line that is indented less",
    ),
    pytest.param(
        "touch:\n  near_mm 3\n  far_mm: 4\n",
        ["3:9: this ':' fits nowhere; check the indentation and the line above, and quote text that holds ': '"],
        id="no colon",
    ),
    pytest.param(
        "touch:\n  far_mm: 4\n  near_mm 3\n",
        ["3:3: no ':' follows this; write 'key: value'"],
        id="no colon in the last line",
    ),
    pytest.param(
        "area:\n  corners_px: [[60, 40], [600, 40], [600, 400], [60, 400]\n  size_mm: [800, 600]\n",
        ["3:3: the list opened in line 2 breaks here; put ',' between its items and ']' after the last"],
        id="an open bracket",
    ),
    pytest.param(
        "touch: {near_mm: 3\ntracking: {}\n",
        ["2:9: the group opened in line 1 breaks here; put ',' between its keys and '}' after the last"],
        id="an open brace",
    ),
    pytest.param(
        "touch: {near_mm: 3}}\n",
        ["1:20: this fits nothing above it; check the indentation, quotes and brackets of this line"],
        id="a bracket too many",
    ),
    pytest.param(
        "source:\n  path: @home\n",
        ["2:9: a value cannot begin with this character; put the value in quotes"],
        id="a character that begins no value",
    ),
    pytest.param(
        'source:\n  path: "C:\\recordings\\desk"\n',
        ["2:24: no such escape in double quotes; use single quotes, or '\\\\' for a backslash"],
        id="a backslash in double quotes",
    ),
    pytest.param(
        'source:\n  path: "\\UFFFFFFFF"\n',
        ["2:12: this escape stands for no character; remove it"],
        id="an escape beyond Unicode",
    ),
    pytest.param(
        'source:\n  path: "\\ud800"\n',
        ["2:9: the character U+D800 has no place in a value; remove it"],
        id="half a character",
    ),
    pytest.param(
        "touch: &a {near_mm: 3}\ntracking: *a\n",
        ["1:8: YAML anchors ('&') are not supported; write the value out where it is needed"],
        id="an alias",
    ),
    pytest.param(
        "tracking: *a\n", ["1:11: YAML aliases ('*') are not supported; write the value out"], id="only an alias"
    ),
    pytest.param(
        "touch:\n  <<: {near_mm: 3}\n",
        ["2:3: YAML merge keys ('<<') are not supported; write the keys out"],
        id="a merge key",
    ),
    pytest.param(
        "touch: !!map {}\n",
        ["1:8: YAML tags ('!') are not supported; remove the tag, or put the value in quotes"],
        id="a tag",
    ),
    pytest.param(
        "source: {serial: !3}\n", ["1:18: '!' begins a YAML tag; put the value in quotes"], id="a lone exclamation mark"
    ),
    pytest.param("[touch]: 3\n", ["1:1: a key must be a single word"], id="a list as a key"),
    pytest.param(
        "touch:\n---\ntracking:\n", ["2:1: a second YAML document begins here; keep one"], id="a second document"
    ),
    pytest.param(
        "outputs: - tuio:\n",
        ["1:10: a list item cannot begin here; put each '- ' on a line of its own"],
        id="a list item in a line of its key",
    ),
    pytest.param(
        "%YAML 9.9\n---\ntouch:\n",
        ["1:1: a line that begins with '%' has no meaning here; remove it"],
        id="a directive",
    ),
    pytest.param(
        "touch: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[\n",
        ["1:27: nested deeper than 20 levels; no key of a config lies so deep"],
        id="deep nesting",
    ),
    pytest.param(
        "touch:\n  near_mm: 3\x00\n",
        ["2:13: the character U+0000 has no place in a config file; remove it"],
        id="a NUL",
    ),
    pytest.param(
        "source: {path: ~no-such-user/desk}\n",
        ['1:16: source.path: no home folder is known for "~no-such-user/desk"; write the whole path'],
        id="a home folder of nobody",
    ),
    pytest.param(
        "outputs:\n  - {}\n",
        ["2:5: outputs: an output is one thing, tuio or events; found none"],
        id="an output that is nothing",
    ),
    pytest.param("version: one\n", ['1:10: version: expected 1, found "one"'], id="a word for a version"),
]


def message_of(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_config(text, "touchd.yaml")
    return str(caught.value)


@pytest.mark.parametrize(("text", "sentences"), MISTAKES)
def test_every_mistake_has_its_place_and_sentence(text: str, sentences: list[str]) -> None:
    assert re.findall(r"^touchd\.yaml:(.*)$", message_of(text), re.MULTILINE) == sentences


def test_problems_come_in_the_order_of_the_file_whatever_their_kind() -> None:
    message = message_of("touch:\n  a: 1\n  method: x\n  method: y\ntracking: {stall_ms: 1}\nb: 1\n")
    assert re.findall(r"yaml:(\d+):", message) == ["2", "3", "4", "5", "6"]


def test_after_twenty_problems_the_rest_is_counted() -> None:
    message = message_of("".join(f"wibble{number}: 1\n" for number in range(MOST_SHOWN + 5)))

    assert message.count("unknown key") == MOST_SHOWN == 20
    assert message.endswith("... and 5 more.\n25 errors; the config was not used.")


def test_of_a_very_long_line_the_part_with_the_mistake_is_shown() -> None:
    message = message_of("touch: {min_area_mm2: 30, " + " " * 500 + "near_mm: far, " + " " * 500 + "}")
    place, line, caret, _count = message.splitlines()

    assert place.startswith("touchd.yaml:1:536: touch.near_mm: expected auto, or millimetres")
    assert len(line) < 120
    assert line[caret.index("^") : caret.rindex("^") + 1] == "far"


def test_long_values_and_keys_are_cut_short() -> None:
    message = message_of(f"source: {{kind: {'x' * 5000}, {'y' * 900}: 1}}")
    assert max(map(len, message.splitlines())) < 350


def test_what_a_file_holds_cannot_steer_the_terminal() -> None:
    message = message_of('"\\e[31mred\\u202e": 1\ntouch: "\u202e"\n')

    assert "\x1b" not in message
    assert "\u202e" not in message
    assert "1:1: \ufffd[31mred\ufffd: unknown key" in message
