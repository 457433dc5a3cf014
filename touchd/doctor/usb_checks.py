"""Findings about what lies between camera and program: USB memory, controller, bandwidth, hubs, autosuspend."""

from collections import defaultdict
from collections.abc import Iterator

from touchd.doctor.computer import Computer
from touchd.doctor.controllers import controller_name, trouble_with
from touchd.doctor.finding import Finding, Level
from touchd.doctor.survey import Survey
from touchd.doctor.usb_devices import controller_of
from touchd.sources.kinect.commands import DEPTH_PACKET_BYTES
from touchd.sources.kinect.stream import PACKETS, TRANSFERS

_MEMORY_LIMIT = "/sys/module/usbcore/parameters/usbfs_memory_mb"
_STREAM_BYTES = TRANSFERS * PACKETS * DEPTH_PACKET_BYTES
# One stream takes 45 of the 100 µs that Linux lets periodic transfers have in each microframe: HS_NSECS_ISO of 1920
# bytes in the kernel's drivers/usb/core/hcd.h, and uframe_periodic_max in drivers/usb/host/ehci-hcd.c.
_MOST_STREAMS_A_BUS = 2
_MANY_HUBS = 3  # one is the Kinect's own
_TLP_CONFIG = "/etc/tlp.conf"
_TLP_REMEDY = (
    'in /etc/tlp.conf: USB_DENYLIST="045e:02ae 045e:02b0 045e:02ad 045e:02bf 045e:02be 045e:02c2", then sudo tlp start'
)


def usb_memory(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether the kernel lets programs have enough memory for the streams of all Kinects at once."""
    limit_mb = computer.number(_MEMORY_LIMIT)
    kinects = max(1, len(found.plugged.kinects))
    needed_mb = kinects * _STREAM_BYTES / 2**20
    needed = f"{kinects} Kinect{'s need' if kinects > 1 else ' needs'} {needed_mb:.1f} MB"
    if limit_mb is None:
        yield Finding("USB memory", Level.NOTE, f"{_MEMORY_LIMIT} cannot be read; {needed}")
    elif limit_mb == 0:
        yield Finding("USB memory", Level.OK, f"no limit for all programs; {needed}")
    else:
        enough = limit_mb >= 2 * needed_mb
        level = Level.OK if enough else Level.PROBLEM if limit_mb < needed_mb else Level.NOTE
        remedy = (
            f"echo 64 | sudo tee {_MEMORY_LIMIT}; for good: usbcore.usbfs_memory_mb=64 on the kernel's command line"
        )
        text = f"{limit_mb} MB for all programs together; {needed}"
        yield Finding("USB memory", level, text, None if enough else remedy)


def controllers(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say which controllers the Kinects hang on, and what was reported of them."""
    del computer
    for kinect in found.plugged.kinects:
        place = kinect.camera.place
        controller = controller_of(kinect.camera)
        if controller is None:
            yield Finding("controller", Level.NOTE, f"{place}: the system does not tell which controller it hangs on")
            continue
        trouble = trouble_with(controller)
        text = f"{place}: {controller_name(controller)}"
        if trouble is None:
            yield Finding("controller", Level.OK, text)
        else:
            yield Finding("controller", Level.NOTE, f"{text}: {trouble.what} ({trouble.source})", trouble.remedy)
        if kinect.camera.hubs_between >= _MANY_HUBS:
            hubs = kinect.camera.hubs_between - 1
            text = f"{place}: {hubs} hubs lie between the computer and the Kinect, some may be the computer's own"
            yield Finding("controller", Level.NOTE, text, "if frames are dropped, plug it in at the computer itself")


def bandwidth(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether the Kinects that share a bus fit it."""
    del computer
    on_bus: dict[int, list[str]] = defaultdict(list)
    for kinect in found.plugged.kinects:
        on_bus[kinect.camera.bus].append(kinect.camera.place)
    for places in on_bus.values():
        if len(places) > _MOST_STREAMS_A_BUS:
            text = f"{', '.join(places)} share one USB bus, which has room for the depth of {_MOST_STREAMS_A_BUS}"
            yield Finding("controller", Level.NOTE, text, "plug the others into ports of another controller")


def autosuspend(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether the system may put parts of a Kinect to sleep, which makes them vanish and come back for ever."""
    parts = [part for kinect in found.plugged.kinects for part in kinect.parts]
    parts += [device for device, _ in found.plugged.without_camera]
    sleepy = [part for part in parts if part.power_control == "auto"]
    if sleepy:
        places = ", ".join(part.place for part in sleepy)
        files = " ".join(f"/sys/bus/usb/devices/{part.name}/power/control" for part in sleepy)
        text = f"the system may suspend {places}, and Kinects were reported to disconnect again and again then"
        yield Finding("autosuspend", Level.NOTE, text, f"echo on | sudo tee {files}{_for_good(computer)}")
    elif parts:
        yield Finding("autosuspend", Level.OK, "the system leaves the Kinect's parts awake")
    if not sleepy and _tlp_may_suspend(computer):
        yield Finding("autosuspend", Level.NOTE, "TLP is installed, and does not leave out Kinects", _TLP_REMEDY)


def _for_good(computer: Computer) -> str:
    return f"; for good, {_TLP_REMEDY}" if _tlp_may_suspend(computer) else ""


def _tlp_may_suspend(computer: Computer) -> bool:
    config = computer.read(_TLP_CONFIG)
    if config is None:
        return False
    settings = [line.strip() for line in config.splitlines()]
    off = any(line.replace('"', "") in {"USB_AUTOSUSPEND=0", "TLP_ENABLE=0"} for line in settings)
    left_out = any(line.startswith("USB_DENYLIST=") and "045e:" in line.lower() for line in settings)
    return not off and not left_out
