import json
from pathlib import Path

import pytest
from touchd.errors import RecordingError
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane

from recording_damage import (
    Damage,
    append,
    cut,
    error_on_opening,
    frames,
    link_to_itself,
    make_folder,
    remove,
    write,
)

FIRST = "d-1500000000.000000-0.pgm"
SECOND = "d-1500000000.033369-2002140.pgm"


@pytest.fixture
def shift_folder(tmp_path: Path) -> Path:
    write_libfreenect(tmp_path / "rec", frames(640, 480), ZeroPlane())
    return tmp_path / "rec"


def set_constant(name: str, value: object) -> Damage:
    def damage(folder: Path) -> None:
        device = json.loads((folder / "device.json").read_text())
        group = device if name == "const_shift" else device["reg_info"]["zero_plane_info"]
        group[name] = value
        (folder / "device.json").write_text(json.dumps(device))

    return damage


def drop_constant(name: str) -> Damage:
    def damage(folder: Path) -> None:
        device = json.loads((folder / "device.json").read_text())
        group = device if name == "const_shift" else device["reg_info"]["zero_plane_info"]
        del group[name]
        (folder / "device.json").write_text(json.dumps(device))

    return damage


def index(*lines: str) -> Damage:
    def damage(folder: Path) -> None:
        (folder / "INDEX.txt").write_text("\n".join(lines))
        for line in lines:
            if line.startswith("d-") and not (folder / line).exists():
                (folder / line).write_bytes((folder / FIRST).read_bytes())

    return damage


def small_pgms(folder: Path) -> None:
    for name in (FIRST, SECOND):
        (folder / name).write_bytes(b"P5 320 240 65535\n" + bytes(2 * 320 * 240))


def test_a_path_that_does_not_exist_is_named(tmp_path: Path) -> None:
    path = tmp_path / "nowhere"
    assert error_on_opening(path) == f"{path} does not exist: check the path of the recording"


def test_an_archive_is_to_be_unpacked_first(tmp_path: Path) -> None:
    path = tmp_path / "rec.tar.xz"
    path.write_bytes(b"\xfd7zXZ\0")
    assert error_on_opening(path) == (
        f"{path} is a file, but a recording is a folder: unpack it first if it is an archive, or name the "
        "folder it lies in; touchd reads folders with INDEX.txt and d-*.pgm (libfreenect), and folders of "
        "16-bit *.png in mm"
    )


@pytest.mark.parametrize(
    ("names", "found"),
    [
        ((), "nothing"),
        (("notes.txt",), "notes.txt"),
        (("a.pgm", "b.pgm", "c.pgm", "d.pgm", "e.pgm"), "a.pgm, b.pgm, c.pgm and 2 more"),
    ],
)
def test_a_folder_of_other_things_is_told_what_was_sought_and_found(
    tmp_path: Path, names: tuple[str, ...], found: str
) -> None:
    for name in names:
        (tmp_path / name).touch()
    message = error_on_opening(tmp_path)
    assert message.startswith(f"{tmp_path} holds neither INDEX.txt nor *.png but {found}: touchd reads folders")


@pytest.mark.parametrize(
    ("damage", "where", "problem"),
    [
        (
            index(FIRST, "nonsense"),
            "INDEX.txt, line 2",
            "reads 'nonsense' where a name such as d-1513096840.225792-2620551265.pgm is expected: correct",
        ),
        (index(FIRST, SECOND[:12]), "INDEX.txt, line 2", f"reads '{SECOND[:12]}' where a name such as"),
        (index(FIRST, "", f"{SECOND} {SECOND}"), "INDEX.txt, line 3", f"reads '{SECOND} d-15"),
        (index("../" + FIRST), "INDEX.txt, line 1", f"reads '../{FIRST}' where a name"),
        (
            index("d-1500000000.000000-0.pgn"),
            "INDEX.txt, line 1",
            "names the depth frame d-1500000000.000000-0.pgn, which is no .pgm: correct the line",
        ),
        (
            index("d-1500000000.000000-4294967296.pgm"),
            "INDEX.txt, line 1",
            "which has 4294967296 device ticks, more than 32 bits hold: correct the line",
        ),
        (
            write("INDEX.txt", FIRST.encode() + b"\nd-15\xff0.0-0.pgm\n"),
            "INDEX.txt, line 2",
            "holds the byte 0xff, which is no UTF-8: restore the line",
        ),
        (
            write("INDEX.txt", b""),
            "INDEX.txt",
            "names no depth frames (d-*.pgm) in its 0 lines: record again",
        ),
        (
            index("a-1500000000.000000-0.dump"),
            "INDEX.txt",
            "names no depth frames (d-*.pgm) in its 1 lines: record again with depth switched on",
        ),
        (
            remove(SECOND),
            "INDEX.txt, line 2",
            f"names {SECOND}, which is not in the folder: copy it there or delete the line",
        ),
        (
            index(FIRST, SECOND, SECOND),
            SECOND,
            f"lies at the same time as {SECOND}, the picture that precedes it, but times must rise: take",
        ),
        (
            index(SECOND, FIRST),
            FIRST,
            f"lies 33.369 ms before {SECOND}, the picture that precedes it, but times must rise: take one",
        ),
        (make_folder("INDEX.txt"), "INDEX.txt", "cannot be read: Is a directory; check its permissions"),
        (make_folder(SECOND), SECOND, "cannot be read: Is a directory; check its permissions"),
        (link_to_itself(SECOND), SECOND, "cannot be read: Too many levels of symbolic links; check"),
        (link_to_itself("device.json"), "device.json", "cannot be read: Too many levels of symbolic links"),
        (
            cut(SECOND, 0),
            SECOND,
            "is empty where a depth picture is expected: copy the file again, or take its",
        ),
        (
            cut(SECOND, 10),
            SECOND,
            "begins with b'P5 640 480' where a PGM header such as 'P5 640 480 65535' is expected: copy the",
        ),
        (
            cut(SECOND, 5000),
            SECOND,
            "is cut short, with 5000 bytes where its header 640x480 makes 614417: copy the file again, or",
        ),
        (
            append(SECOND, b"\0"),
            SECOND,
            "is too long, with 614418 bytes where its header 640x480 makes 614417: copy the file again, or",
        ),
        (
            write(SECOND, b"P6 640 480 255\n" + bytes(3 * 640 * 480)),
            SECOND,
            "begins with b'P6 640 480 255\\n\\x00' where a PGM header such as 'P5 640 480 65535' is expected",
        ),
        (
            write(SECOND, b"P5 640 480 255\n" + bytes(640 * 480)),
            SECOND,
            "gives 255 as its greatest value where raw 11-bit depth has 2047 to 65535: record raw",
        ),
        (
            write(SECOND, b"P5 320 240 65535\n" + bytes(2 * 320 * 240)),
            SECOND,
            f"has 320x240 pixels but {FIRST} has 640x480: all depth pictures of a recording must have",
        ),
        (small_pgms, FIRST, "has 320x240 pixels where a Kinect v1 has 640x480: record at 640x480"),
        (write("device.json", b'{"reg_info'), "device.json", "is not valid JSON (Unterminated string"),
        (write("device.json", b"\xff\xff\xff"), "device.json", "is not valid JSON ("),
        (write("device.json", b"[" * 100_000), "device.json", "is not valid JSON ("),
        (
            write("device.json", b"[1]"),
            "device.json",
            "has no reg_info.zero_plane_info.dcmos_emitter_distance (usually 7.5): correct it, or delete the",
        ),
        (
            drop_constant("reference_pixel_size"),
            "device.json",
            "has no reg_info.zero_plane_info.reference_pixel_size (usually 0.1042): correct it, or delete",
        ),
        (drop_constant("const_shift"), "device.json", "has no const_shift (usually 200): correct it, or"),
        (
            set_constant("reference_distance", 0),
            "device.json",
            "zero_plane_info.reference_distance, which must be a positive number near the usual 120: correct",
        ),
        (
            set_constant("dcmos_emitter_distance", -7.5),
            "device.json",
            "has -7.5 as reg_info.zero_plane_info.dcmos_emitter_distance, which must be a positive number",
        ),
        (set_constant("const_shift", float("nan")), "device.json", "has NaN as const_shift, which must be"),
        (set_constant("const_shift", float("inf")), "device.json", "has Infinity as const_shift, which must"),
        (set_constant("const_shift", 10**400), "device.json", f"has {10**39} as const_shift, which must be"),
        (set_constant("const_shift", "200"), "device.json", 'has "200" as const_shift, which must be'),
        (
            set_constant("dcmos_emitter_distance", True),
            "device.json",
            "has true as reg_info.zero_plane_info.dcmos_emitter_distance, which must be a positive number",
        ),
        (set_constant("const_shift", {}), "device.json", "has a group of values as const_shift, which must"),
    ],
)
def test_a_damaged_libfreenect_recording_is_refused_before_its_first_frame(
    shift_folder: Path, damage: Damage, where: str, problem: str
) -> None:
    damage(shift_folder)
    message = error_on_opening(shift_folder)
    assert message.startswith(str(shift_folder / where))
    assert problem in message


def test_a_value_beyond_11_bits_is_damage_of_that_frame_alone(shift_folder: Path) -> None:
    path = shift_folder / SECOND
    data = bytearray(path.read_bytes())
    data[17 + 2 * (640 * 3 + 5) : 17 + 2 * (640 * 3 + 5) + 2] = b"\x00\x08"
    path.write_bytes(data)
    recording = open_recording(shift_folder)
    assert recording.read(0).raw[0, 0] == 700
    with pytest.raises(RecordingError) as caught:
        recording.read(1)
    assert str(caught.value) == (
        f"{path} holds 2048 in row 3, column 5, beyond the 2047 of raw 11-bit depth, so it is damaged or "
        "big-endian: copy the file again, or take its line out of INDEX.txt"
    )


def test_a_picture_that_vanishes_or_shrinks_after_opening_is_a_recording_error(shift_folder: Path) -> None:
    recording = open_recording(shift_folder)
    cut(FIRST, 900)(shift_folder)
    (shift_folder / SECOND).unlink()
    with pytest.raises(RecordingError, match=f"{FIRST} was cut short after the recording was opened: copy"):
        recording.read(0)
    with pytest.raises(RecordingError, match=f"{SECOND} cannot be read: No such file or directory; check"):
        recording.read(1)
