"""Findings about the cameras themselves: which there are, their power, the kernel's driver, who holds them."""

from collections.abc import Iterator

from touchd.doctor.computer import Computer
from touchd.doctor.finding import Finding, Level
from touchd.doctor.listing import chosen_place
from touchd.doctor.survey import Survey
from touchd.doctor.use import KERNEL_DRIVER, Use, use_of

_HIGH_SPEED_MBIT = 480
_BLACKLIST = (
    "only if other programs must not see it as a webcam: echo blacklist gspca_kinect | sudo tee"
    " /etc/modprobe.d/touchd.conf"
)


def plugged_in(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say which cameras there are, and which one touchd would use."""
    del computer
    chosen, why_not = chosen_place(found)
    wanted = Level.PROBLEM if found.wants_kinect else Level.NOTE
    for kinect in found.plugged.kinects:
        place = kinect.camera.place
        mine = "; touchd would use it" if place == chosen else ""
        yield Finding("camera", Level.OK, f"{kinect.model}, serial {kinect.serial or 'none'}, at {place}{mine}")
    if why_not is not None:
        yield Finding("camera", wanted, why_not, "correct source in the config" if found.wants_kinect else None)
    for device, name in found.plugged.others:
        yield Finding("camera", Level.NOTE, f"{name} at {device.place}: not supported yet by this version of touchd")
    if not found.plugged.kinects and not found.plugged.without_camera:
        level = wanted if found.config_problem is None else Level.NOTE
        yield Finding("camera", level, "no Kinect is plugged in", "connect its USB cable and its power supply")


def power(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say of which Kinects only a part is there: their camera and most of their parts live on the power supply."""
    del computer
    for device, part in found.plugged.without_camera:
        level = Level.NOTE if found.plugged.kinects or not found.wants_kinect else Level.PROBLEM
        yield Finding(
            "power",
            level,
            f"of the Kinect at {device.place} only the {part.value} is there, its camera is not",
            "connect the Kinect's power supply, USB alone does not suffice; if it is connected, try another port, and"
            " switch USB autosuspend off (below)",
        )
    for kinect in found.plugged.kinects:
        speed_mbit = kinect.camera.speed_mbit
        if speed_mbit is not None and speed_mbit < _HIGH_SPEED_MBIT:
            yield Finding(
                "power",
                Level.PROBLEM,
                f"the camera at {kinect.camera.place} runs at {speed_mbit} Mbit/s, its depth needs {_HIGH_SPEED_MBIT}",
                "use a USB 2 or USB 3 port, another cable, and no USB 1 hub",
            )


def kernel_driver(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether the kernel's own Kinect driver is there."""
    bound = [kinect.camera.place for kinect in found.plugged.kinects if KERNEL_DRIVER in kinect.camera.drivers]
    if bound:
        yield Finding(
            "driver",
            Level.OK,
            f"the kernel's gspca_kinect has {', '.join(bound)}: touchd takes the camera from it by itself",
            _BLACKLIST,
        )
    elif computer.exists("/sys/module/gspca_kinect"):
        yield Finding("driver", Level.OK, "the kernel's gspca_kinect is loaded and has no camera")
    else:
        yield Finding("driver", Level.OK, "the kernel's gspca_kinect is not loaded")


def in_use(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say which programs have a camera open."""
    unseen = "" if found.open_files.complete else "; only root sees all programs: sudo touchd doctor"
    chosen, _ = chosen_place(found)
    for kinect in found.plugged.kinects:
        use, place = use_of(computer, found, kinect), kinect.camera.place
        if use.use is Use.TOUCHD:
            who = ", ".join(map(str, use.by)) or "the running touchd"
            yield Finding("in use", Level.OK, f"{place} is in use by {who}")
        elif use.use is Use.HELD:
            level = Level.PROBLEM if place == chosen else Level.NOTE
            yield Finding("in use", level, f"{place} is held by {use.who}{unseen}", "stop that program")
        else:
            yield Finding("in use", Level.OK, f"no program has {place} open{unseen}")
