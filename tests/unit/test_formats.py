import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from touchd.errors import OutputError
from touchd.formats.libfreenect import write_libfreenect
from touchd.formats.png_folder import write_png_folder
from touchd.formats.recording import open_recording
from touchd.geometry import ZeroPlane
from touchd.model import Frame, Image16

KINECT_MM2 = 345489.0
FRAME_NS = 33_369_250


def shift_picture(value: int) -> Image16:
    return np.full((480, 640), value, np.uint16)


def kinect_frames(*times_ns: int) -> list[Frame]:
    return [Frame(i, t, shift_picture(600 + i)) for i, t in enumerate(times_ns)]


def rename_in_index(folder: Path, old: str, new: str) -> None:
    (folder / old).rename(folder / new)
    index = folder / "INDEX.txt"
    index.write_text(index.read_text().replace(old, new))


def save_png(path: Path, picture: Image16) -> None:
    path.write_bytes(cv2.imencode(".png", picture)[1].tobytes())


# libfreenect: reading


def test_a_real_recording_opens_with_its_times_and_nothing_to_note(desk_recording: Path) -> None:
    recording = open_recording(desk_recording)
    assert (len(recording), recording.path, recording.notes) == (80, desk_recording, ())
    assert recording.times_ns[:3] == (0, 31_173_000, 64_077_000)
    assert recording.times_ns[-1] == 2_639_665_000
    assert recording.sensor.kind == "kinect-v1"


def test_a_real_frame_shows_the_box_that_stood_on_the_desk(desk_recording: Path) -> None:
    recording = open_recording(desk_recording)
    frame = recording.read(40)
    assert (frame.index, frame.t_ns, frame.missing_packets) == (40, recording.times_ns[40], 0)
    assert frame.raw.shape == (480, 640)
    assert frame.raw.dtype == np.uint16
    box = frame.raw[236:282, 520:628]
    assert abs(float(np.median(box[box < 2047])) - 794) <= 1
    assert (frame.raw[:, -8:] == 2047).all()


def test_the_rendered_table_has_a_frame_for_every_line_of_its_truth(table_recording: Path) -> None:
    recording = open_recording(table_recording)
    truth = json.loads((table_recording / "truth.json").read_text())
    assert len(recording) == len(truth) == 207
    assert recording.notes == ()
    assert abs(np.nanmedian(recording.sensor.to_mm[recording.read(0).raw]) - 820) < 5


def test_pictures_cannot_be_changed(tmp_path: Path) -> None:
    write_libfreenect(tmp_path / "shift", kinect_frames(0), ZeroPlane())
    write_png_folder(tmp_path / "mm", kinect_frames(0))
    for name in ("shift", "mm"):
        with pytest.raises(ValueError, match="read-only"):
            open_recording(tmp_path / name).read(0).raw[0, 0] = 1


def test_frames_beyond_either_end_are_an_index_error(tmp_path: Path) -> None:
    write_libfreenect(tmp_path / "shift", kinect_frames(0), ZeroPlane())
    write_png_folder(tmp_path / "mm", kinect_frames(0))
    for name in ("shift", "mm"):
        recording = open_recording(tmp_path / name)
        for index in (-1, 1):
            with pytest.raises(IndexError):
                recording.read(index)


def test_colour_and_acceleration_are_passed_over_and_line_ends_may_be_those_of_windows(
    tmp_path: Path,
) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, FRAME_NS), ZeroPlane())
    first, second = (tmp_path / "INDEX.txt").read_text().split()
    lines = ["r-1500000000.000000-0.ppm", first, "", "a-1500000000.010000-9.dump", second]
    (tmp_path / "INDEX.txt").write_bytes(b"\xef\xbb\xbf" + "\r\n".join(lines).encode())
    recording = open_recording(tmp_path)
    assert [int(recording.read(i).raw[0, 0]) for i in range(len(recording))] == [600, 601]


def test_a_header_may_have_comments_and_any_white_space(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0), ZeroPlane())
    picture = tmp_path / "d-1500000000.000000-0.pgm"
    values = shift_picture(0x0123).astype("<u2").tobytes()
    picture.write_bytes(b"P5 # made by hand\n#640 1\r\n640\t480\n# greatest\n 2047\n" + values)
    assert (open_recording(tmp_path).read(0).raw == 0x0123).all()


def test_times_are_exact_to_the_nanosecond(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, FRAME_NS), ZeroPlane())
    rename_in_index(tmp_path, "d-1500000000.000000-0.pgm", "d-1499999999.999999999-0.pgm")
    assert open_recording(tmp_path).times_ns == (0, 33_369_001)


def test_lost_frames_are_counted_by_the_cameras_clock(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, *(n * FRAME_NS for n in (1, 2, 4, 5, 8))), ZeroPlane())
    assert open_recording(tmp_path).notes == (
        "2 gaps in the camera's own clock: about 3 frames were lost while recording",
    )


def test_one_lost_frame_is_told_in_the_singular(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, 2 * FRAME_NS), ZeroPlane())
    assert open_recording(tmp_path).notes == (
        "1 gap in the camera's own clock: about 1 frame was lost while recording",
    )


def test_the_cameras_clock_may_wrap_without_a_gap(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, FRAME_NS), ZeroPlane())
    rename_in_index(tmp_path, "d-1500000000.000000-0.pgm", f"d-1500000000.000000-{2**32 - 1_000_000}.pgm")
    rename_in_index(tmp_path, "d-1500000000.033369-2002140.pgm", "d-1500000000.033369-1002140.pgm")
    assert open_recording(tmp_path).notes == ()


def test_a_pause_longer_than_the_cameras_clock_counts_is_measured_by_both_clocks(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, 6000 * FRAME_NS), ZeroPlane())
    assert open_recording(tmp_path).notes == (
        "1 gap in the camera's own clock: about 5999 frames were lost while recording",
    )


def test_a_camera_clock_that_starts_anew_is_no_gap_but_is_noted(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, FRAME_NS), ZeroPlane())
    rename_in_index(tmp_path, "d-1500000000.000000-0.pgm", "d-1500000000.000000-900000000.pgm")
    (note,) = open_recording(tmp_path).notes
    assert note.startswith("the camera's own clock stands still or runs backwards at 1 frame: what was lost")


def test_a_camera_clock_that_stands_still_is_noted(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, 30_000_000, 60_000_000), ZeroPlane())
    rename_in_index(tmp_path, "d-1500000000.030000-1800000.pgm", "d-1500000000.030000-0.pgm")
    rename_in_index(tmp_path, "d-1500000000.060000-3600000.pgm", "d-1500000000.060000-0.pgm")
    (note,) = open_recording(tmp_path).notes
    assert note.startswith("the camera's own clock stands still or runs backwards at 2 frames: what was lost")


def test_pictures_that_the_index_does_not_name_are_left_out_and_noted(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, FRAME_NS), ZeroPlane())
    (tmp_path / "INDEX.txt").write_text("d-1500000000.000000-0.pgm\n")
    recording = open_recording(tmp_path)
    assert len(recording) == 1
    assert recording.notes == ("1 depth picture in the folder but not in INDEX.txt and so left out",)


def test_without_device_json_the_usual_constants_are_used_and_noted(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0), ZeroPlane(8.0, 100.0, 0.1, 210.0))
    (tmp_path / "device.json").unlink()
    recording = open_recording(tmp_path)
    assert recording.notes == ("device.json is missing: the usual constants of a Kinect v1 are used",)
    assert abs(recording.sensor.to_mm[600] - KINECT_MM2 / (1089.41 - 600)) < 0.01


def test_depth_follows_the_constants_in_device_json(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0), ZeroPlane(8.0, 100.0, 0.1, 210.0))
    metric = ((600 - 4 * 210) / 4 - 0.375) * 0.1
    expected = 10 * (metric * 100 / (8 - metric) + 100)
    assert abs(open_recording(tmp_path).sensor.to_mm[600] - expected) < 1e-3


def test_pictures_without_any_reading_are_frames_like_others(tmp_path: Path) -> None:
    write_libfreenect(tmp_path / "shift", [Frame(0, 0, shift_picture(2047))], ZeroPlane())
    write_png_folder(tmp_path / "mm", [Frame(i, i * FRAME_NS, shift_picture(0)) for i in range(2)])
    assert (open_recording(tmp_path / "shift").read(0).raw == 2047).all()
    recording = open_recording(tmp_path / "mm")
    assert (recording.read(1).raw == 0).all()
    assert recording.sensor.noise == 1.0
    assert recording.notes == ("the first pictures do not tell the camera's noise: 1 mm is assumed",)


# libfreenect: writing


def test_a_written_recording_looks_as_libfreenect_itself_writes_it(tmp_path: Path) -> None:
    start_ns = 123_456_789_000
    frames = kinect_frames(start_ns, start_ns + 72_000_000_000)
    assert write_libfreenect(tmp_path, frames, ZeroPlane(), start_s=1_600_000_000) == 2
    names = ["d-1600000000.000000-0.pgm", f"d-1600000072.000000-{72 * 60_000_000 - 2**32}.pgm"]
    assert (tmp_path / "INDEX.txt").read_text() == "".join(f"{name}\n" for name in names)
    assert (tmp_path / names[1]).read_bytes() == b"P5 640 480 65535\n" + b"\x59\x02" * 640 * 480
    device = json.loads((tmp_path / "device.json").read_text())
    assert device["const_shift"] == 200
    assert device["reg_info"]["zero_plane_info"] == {
        "dcmos_emitter_distance": 7.5,
        "dcmos_rcmos_distance": 2.4,
        "reference_distance": 120.0,
        "reference_pixel_size": 0.1042,
    }


def test_written_times_are_rounded_to_the_nearest_microsecond(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0, 33_333_333, 66_666_667), ZeroPlane())
    assert open_recording(tmp_path).times_ns == (0, 33_333_000, 66_667_000)


def test_real_frames_survive_writing_and_reading(desk_recording: Path, tmp_path: Path) -> None:
    original = open_recording(desk_recording)
    write_libfreenect(tmp_path, (original.read(i) for i in range(3)), ZeroPlane())
    copy = open_recording(tmp_path)
    assert copy.times_ns == original.times_ns[:3]
    assert all(np.array_equal(copy.read(i).raw, original.read(i).raw) for i in range(3))


@pytest.mark.parametrize(
    ("frames", "problem"),
    [
        ([Frame(0, 0, np.zeros((4, 6), np.uint16))], "Frame 0 has 6x4 pixels"),
        ([Frame(0, 0, shift_picture(2048))], "Frame 0 holds the value 2048"),
        (kinect_frames(0, 400), "Frame 1 comes 0 us after the one before it"),
        (kinect_frames(9000, 5000), "Frame 1 comes -4 us after the one before it"),
    ],
)
def test_frames_that_libfreenects_format_cannot_hold_are_refused(
    tmp_path: Path, frames: list[Frame], problem: str
) -> None:
    with pytest.raises(OutputError, match=f"^{problem}, but a libfreenect recording holds rising times"):
        write_libfreenect(tmp_path, frames, ZeroPlane())
    assert not (tmp_path / "INDEX.txt").exists()


@pytest.mark.parametrize(
    ("second", "problem"),
    [
        (Frame(1, 5, np.zeros((4, 6), np.uint16)), "Frame 1 has 6x4 pixels after 640x480 before"),
        (Frame(1, 0, shift_picture(1)), "Frame 1 comes 0 ns after the one before it"),
    ],
)
def test_frames_that_one_png_folder_cannot_hold_are_refused(tmp_path: Path, second: Frame, problem: str) -> None:
    with pytest.raises(OutputError, match=f"^{problem}, but a PNG recording holds rising times and one size"):
        write_png_folder(tmp_path, [Frame(0, 0, shift_picture(1)), second])


# PNG folders


def test_pictures_without_times_count_as_30_a_second_in_their_natural_order(tmp_path: Path) -> None:
    for name, value in (("Depth10.PNG", 3), ("depth9.png", 2), ("depth1.png", 1)):
        save_png(tmp_path / name, np.full((3, 4), value, np.uint16))
    (tmp_path / "._depth1.png").write_bytes(b"left by another system")
    (tmp_path / "readme.txt").write_text("no picture")
    recording = open_recording(tmp_path)
    assert [int(recording.read(i).raw[0, 0]) for i in range(len(recording))] == [1, 2, 3]
    assert recording.times_ns == (0, 33_333_333, 66_666_667)
    assert recording.notes == ("the file names tell no times: 30 frames a second are assumed",)


def test_pictures_named_by_their_time_come_in_the_order_of_their_times(tmp_path: Path) -> None:
    for name, value in (("1305031102.5", 3), ("1305031102.160407", 1), ("1305031102.25", 2)):
        save_png(tmp_path / f"{name}.png", np.full((3, 4), value, np.uint16))
    recording = open_recording(tmp_path)
    assert [int(recording.read(i).raw[0, 0]) for i in range(3)] == [1, 2, 3]
    assert recording.times_ns == (0, 89_593_000, 339_593_000)
    assert recording.notes == ()


def test_a_folder_of_pictures_has_a_sensor_in_millimetres_of_their_size(tmp_path: Path) -> None:
    write_png_folder(tmp_path, [Frame(i, i * FRAME_NS, np.full((240, 320), 900, np.uint16)) for i in range(2)])
    sensor = open_recording(tmp_path).sensor
    assert (sensor.kind, sensor.unit, sensor.invalid, sensor.size) == ("depth-mm", "mm", 0, (320, 240))
    k = sensor.intrinsics
    assert (k.fx, k.fy, k.cx, k.cy) == (287.9, 287.9, 159.5, 119.5)


def test_an_index_makes_a_folder_libfreenects_whatever_else_lies_in_it(tmp_path: Path) -> None:
    write_libfreenect(tmp_path, kinect_frames(0), ZeroPlane())
    save_png(tmp_path / "preview.png", np.full((3, 4), 1, np.uint16))
    assert open_recording(tmp_path).sensor.kind == "kinect-v1"


def test_a_lone_picture_leaves_the_noise_to_be_assumed(tmp_path: Path) -> None:
    write_png_folder(tmp_path, [Frame(0, 0, shift_picture(800))])
    recording = open_recording(tmp_path)
    assert recording.sensor.noise == 1.0
    assert recording.notes == ("the first pictures do not tell the camera's noise: 1 mm is assumed",)
