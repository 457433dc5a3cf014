import pytest
from touchd.config.load import parse_config
from touchd.errors import ConfigError

TYPICAL_MISTAKES = [
    pytest.param(
        """\
touch:
  far_mn: 14
tracking:
  stall_ms: soon
""",
        """\
touchd.yaml:2:3: touch.far_mn: unknown key; did you mean 'far_mm'?
     2 |   far_mn: 14
       |   ^^^^^^
touchd.yaml:4:13: tracking.stall_ms: expected milliseconds from 34 to 5000, found "soon"
     4 |   stall_ms: soon
       |             ^^^^
2 errors; the config was not used.
""",
        id="a misspelt key and a word for a number, both at once",
    ),
    pytest.param(
        """\
calibration:
  frames: 3
touch: {near_mm: -3}
""",
        """\
touchd.yaml:2:11: calibration.frames: expected a whole number of frames from 10 to 10000, found 3
     2 |   frames: 3
       |           ^
touchd.yaml:3:18: touch.near_mm: expected auto, or millimetres from 0 to 100, found -3
     3 | touch: {near_mm: -3}
       |                  ^^
2 errors; the config was not used.
""",
        id="a number out of its range",
    ),
    pytest.param(
        """\
touch:
  far_mm: 14 mm
  shell:
    threshold: 0,2
tracking:
  stall_ms: "150"
""",
        """\
touchd.yaml:2:11: touch.far_mm: expected auto, or millimetres from 1 to 200, found "14 mm"; write it as 14
     2 |   far_mm: 14 mm
       |           ^^^^^
touchd.yaml:4:16: touch.shell.threshold: expected a share from 0.01 to 1, found "0,2"; write it as 0.2
     4 |     threshold: 0,2
       |                ^^^
touchd.yaml:6:13: tracking.stall_ms: expected milliseconds from 34 to 5000, found "150"; write it as 150
     6 |   stall_ms: "150"
       |             ^^^^^
3 errors; the config was not used.
""",
        id="a number with its unit, one with a decimal comma, and one in quotes",
    ),
    pytest.param(
        """\
source:
  kind: Kinnect
""",
        """\
touchd.yaml:2:9: source.kind: expected kinect, recording, synthetic or realsense, found "Kinnect"; did you mean 'kinect'?
     2 |   kind: Kinnect
       |         ^^^^^^^
1 error; the config was not used.
""",  # noqa: E501
        id="a misspelt choice",
    ),
    pytest.param(
        """\
source:
  serial: 0123622270882
""",
        """\
touchd.yaml:2:11: source.serial: expected text, found 0123622270882; put it in quotes: "0123622270882"
     2 |   serial: 0123622270882
       |           ^^^^^^^^^^^^^
1 error; the config was not used.
""",
        id="a serial number that reads as a number",
    ),
    pytest.param(
        """\
stall_ms: 100
calibration:
  threshold: 0.5
tracking:
  source: kinect
""",
        """\
touchd.yaml:1:1: stall_ms: unknown key here; it belongs under 'tracking:', indented further
     1 | stall_ms: 100
       | ^^^^^^^^
touchd.yaml:3:3: calibration.threshold: unknown key here; it belongs under 'touch.shell:'
     3 |   threshold: 0.5
       |   ^^^^^^^^^
touchd.yaml:5:3: tracking.source: unknown key here; it belongs at the top, without indentation
     5 |   source: kinect
       |   ^^^^^^
3 errors; the config was not used.
""",
        id="a key in the wrong section",
    ),
    pytest.param(
        """\
outputs:
  - tuio:
    to: ["127.0.0.1:3333"]
""",
        """\
touchd.yaml:3:5: outputs[0].to: unknown key here; it belongs under 'tuio:', indented further
     3 |     to: ["127.0.0.1:3333"]
       |     ^^
1 error; the config was not used.
""",
        id="an output's keys beside it, not under it",
    ),
    pytest.param(
        """\
outputs:
  tuio:
    profile: 2Dcur
""",
        """\
touchd.yaml:2:3: outputs: expected list items '- tuio:' or '- events:', or [] for no output, found a group of keys
     2 |   tuio:
       |   ^
1 error; the config was not used.
""",
        id="outputs without a dash",
    ),
    pytest.param(
        """\
outputs:
  - tuio: {map: [0.5, 0, 0.2, 1], flip_x: yes, max_cursors: 0}
  - tuio: {map: [0, 0, 0, 1]}
  - tuio: {map: [0, 1, 1, 2], interface: eth0}
""",
        """\
touchd.yaml:2:17: outputs[0].tuio.map: left and right are 0.5 and 0.2; give the lesser first, and use flip_x to turn \
them round
     2 |   - tuio: {map: [0.5, 0, 0.2, 1], flip_x: yes, max_cursors: 0}
       |                 ^
touchd.yaml:2:43: outputs[0].tuio.flip_x: expected true or false, found "yes"
     2 |   - tuio: {map: [0.5, 0, 0.2, 1], flip_x: yes, max_cursors: 0}
       |                                           ^^^
touchd.yaml:2:61: outputs[0].tuio.max_cursors: expected a whole number of touches from 1 to 60, found 0
     2 |   - tuio: {map: [0.5, 0, 0.2, 1], flip_x: yes, max_cursors: 0}
       |                                                             ^
touchd.yaml:3:17: outputs[1].tuio.map: left and right are both 0; leave room between them
     3 |   - tuio: {map: [0, 0, 0, 1]}
       |                 ^
touchd.yaml:4:17: outputs[2].tuio.map: top and bottom are 1 and 2, beyond the screen, which is 0 to 1; nothing would \
be sent
     4 |   - tuio: {map: [0, 1, 1, 2], interface: eth0}
       |                 ^
touchd.yaml:4:42: outputs[2].tuio.interface: expected an IPv4 address such as 192.168.0.2, found "eth0"
     4 |   - tuio: {map: [0, 1, 1, 2], interface: eth0}
       |                                          ^^^^
6 errors; the config was not used.
""",
        id="where touches go on the client's screen",
    ),
    pytest.param(
        """\
outputs:
  - tuio: {to: ["127.0.0.1:3335"], profile: 3Dcur}
""",
        """\
touchd.yaml:2:45: outputs[0].tuio.profile: expected 2Dcur, 25Dcur or 2Dblb, found "3Dcur"; did you mean '2Dcur'?
     2 |   - tuio: {to: ["127.0.0.1:3335"], profile: 3Dcur}
       |                                             ^^^^^
1 error; the config was not used.
""",
        id="a profile that touchd does not send",
    ),
    pytest.param(
        """\
outputs:
  - tuio: {to: ["table:3333", "localhost:3334"]}
  - tuio: {to: ["127.0.0.1:3334"], profile: 25Dcur}
""",
        """\
touchd.yaml:2:3: outputs: 127.0.0.1:3334 gets 2Dcur and 25Dcur, and clients stumble over a second profile on their \
port (Kivy stops listening); send each profile to a port of its own
     2 |   - tuio: {to: ["table:3333", "localhost:3334"]}
       |   ^
1 error; the config was not used.
""",
        id="two profiles on one port",
    ),
    pytest.param(
        """\
outputs:
  - tuio: {interface: 192.168.0.2}
""",
        """\
touchd.yaml:2:12: outputs[0].tuio.interface: for multicast alone, and no destination is a multicast address; found \
127.0.0.1:3333; remove it, or send to one of 224.0.0.0 to 239.255.255.255
     2 |   - tuio: {interface: 192.168.0.2}
       |            ^^^^^^^^^
1 error; the config was not used.
""",
        id="an interface without multicast",
    ),
    pytest.param(
        """\
outputs:
  - tuio: {to: [localhost, "wall:70000", 3333]}
  - tuio: {to: "127.0.0.1:3333"}
  - tuio: {to: []}
""",
        """\
touchd.yaml:2:17: outputs[0].tuio.to: "localhost" has no port; write it as host:port, for example "127.0.0.1:3333"
     2 |   - tuio: {to: [localhost, "wall:70000", 3333]}
       |                 ^^^^^^^^^
touchd.yaml:2:28: outputs[0].tuio.to: "wall:70000" has the port "70000"; give a whole number from 1 to 65535
     2 |   - tuio: {to: [localhost, "wall:70000", 3333]}
       |                            ^^^^^^^^^^^^
touchd.yaml:2:42: outputs[0].tuio.to: expected a list of destinations such as ["127.0.0.1:3333"], found 3333
     2 |   - tuio: {to: [localhost, "wall:70000", 3333]}
       |                                          ^^^^
touchd.yaml:3:16: outputs[1].tuio.to: expected a list of destinations such as ["127.0.0.1:3333"], found "127.0.0.1:3333"
     3 |   - tuio: {to: "127.0.0.1:3333"}
       |                ^^^^^^^^^^^^^^^^
touchd.yaml:4:16: outputs[2].tuio.to: expected at least one destination such as "127.0.0.1:3333", found an empty list
     4 |   - tuio: {to: []}
       |                ^
5 errors; the config was not used.
""",
        id="destinations that are none",
    ),
    pytest.param(
        """\
touch:
  near_mm: 3
  near_mm: 4

touch:
  far_mm: 9
""",
        """\
touchd.yaml:3:3: touch.near_mm: given twice, first in line 2; keep one
     3 |   near_mm: 4
       |   ^^^^^^^
touchd.yaml:5:1: touch: given twice, first in line 1; keep one
     5 | touch:
       | ^^^^^
2 errors; the config was not used.
""",
        id="a key given twice, and a section given twice",
    ),
    pytest.param(
        """\
area:
  corners_px: [[60, 40], [60, 400], [600, 400], [600, 40]]
""",
        """\
touchd.yaml:2:15: area.corners_px: the corners run anticlockwise in the picture; give top-left, top-right, bottom-right, bottom-left
     2 |   corners_px: [[60, 40], [60, 400], [600, 400], [600, 40]]
       |               ^
1 error; the config was not used.
""",  # noqa: E501
        id="corners in the wrong order",
    ),
    pytest.param(
        """\
touch:
  near_mm: 10
  far_mm: 8
""",
        """\
touchd.yaml:3:3: touch.far_mm: expected more than near_mm (10), found 8
     3 |   far_mm: 8
       |   ^^^^^^
1 error; the config was not used.
""",
        id="an upper boundary below the lower one",
    ),
    pytest.param(
        """\
touch: shell
tracking: [stall_ms, 150]
""",
        """\
touchd.yaml:1:8: touch: expected keys below it, such as 'method:', found "shell"
     1 | touch: shell
       |        ^^^^^
touchd.yaml:2:11: tracking: expected keys below it, such as 'stall_ms:', found a list of 2
     2 | tracking: [stall_ms, 150]
       |           ^
2 errors; the config was not used.
""",
        id="a value where a section belongs",
    ),
    pytest.param(
        """\
version: 2
""",
        """\
touchd.yaml:1:10: version: this file has layout 2, and this touchd reads layout 1; update touchd, or write the file anew from the touchd.yaml that came with it
     1 | version: 2
       |          ^
1 error; the config was not used.
""",  # noqa: E501
        id="a file for a newer touchd",
    ),
    pytest.param(
        "touch:\n\tnear_mm: 3\n",
        """\
touchd.yaml:2:1: a tab where only spaces may stand; indent and separate with spaces
     2 |  near_mm: 3
       | ^
1 error; the config was not used.
""",
        id="a tab",
    ),
    pytest.param(
        """\
touch:
  near_mm: 3
   far_mm: 4
""",
        """\
touchd.yaml:3:10: this ':' fits nowhere; check the indentation and the line above, and quote text that holds ': '
     3 |    far_mm: 4
       |          ^
1 error; the config was not used.
""",
        id="a line that is indented further",
    ),
    pytest.param(
        """\
touch:
  near_mm: "3
  far_mm: 4
""",
        """\
touchd.yaml:2:12: the quote opened here is never closed
     2 |   near_mm: "3
       |            ^
1 error; the config was not used.
""",
        id="an open quote",
    ),
]


def message_of(text: str) -> str:
    with pytest.raises(ConfigError) as caught:
        parse_config(text, "touchd.yaml")
    return str(caught.value)


@pytest.mark.parametrize(("text", "message"), TYPICAL_MISTAKES)
def test_a_typical_mistake_is_told_with_its_line_a_caret_and_the_remedy(text: str, message: str) -> None:
    assert message_of(text) == message.removesuffix("\n")


def test_a_bad_config_has_its_own_exit_code() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_config("touch: 3", "touchd.yaml")
    assert int(caught.value.exit_code) == 78
