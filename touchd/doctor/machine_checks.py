"""Findings about the computer: Python packages, libusb, memory, processor, clock."""

import platform
import sys
from collections.abc import Iterator
from datetime import UTC, datetime

from touchd.doctor.computer import Computer
from touchd.doctor.finding import Finding, Level
from touchd.doctor.survey import Survey

_NEEDED = ("numpy", "cv2", "pythonosc", "usb", "yaml", "pydantic")
# Later versions of touchd use these for the console, for recordings, and for other outputs and cameras.
_EXTRAS = ("aiohttp", "mcap", "evdev", "pyrealsense2")
_LEAST_MEMORY_KB = 200_000  # touchd takes 120 MB
_CLOCK_IS_SET_S = datetime(2025, 1, 1, tzinfo=UTC).timestamp()
# These drivers' powersave follows the load; see the kernel's Documentation/admin-guide/pm/intel_pstate.rst, amd-pstate.
_OWN_GOVERNORS = ("intel_pstate", "amd-pstate", "amd-pstate-epp", "amd_pstate", "amd_pstate_epp")
_CPUFREQ = "/sys/devices/system/cpu/cpu0/cpufreq"


def python(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether all packages can be loaded, and libusb."""
    here = f"Python {platform.python_version()} on {platform.machine()}"
    broken = list(_broken(computer))
    if not broken:
        yield Finding("python", Level.OK, f"{here}: all packages load")
    for module, why in broken:
        text = f"{here}: {module} does not load ({why})"
        yield Finding("python", Level.PROBLEM, text, f"{sys.executable} -m pip install --force-reinstall touchd")
    missing = [module for module in _EXTRAS if not computer.is_installed(module)]
    if missing:
        text = f"not installed, and not needed by this version: {', '.join(missing)}{_on_arm(missing)}"
        yield Finding("python", Level.OK, text)
    if found.no_libusb is None:
        yield Finding("python", Level.OK, "libusb is there")
    else:
        level = Level.PROBLEM if found.wants_kinect else Level.NOTE
        yield Finding("python", level, found.no_libusb.partition(":")[0], "apt-get install libusb-1.0-0")


def machine(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether memory, processor and clock suffice."""
    del found
    yield from _memory(computer)
    yield from _processor(computer)
    now = datetime.fromtimestamp(computer.now_s(), UTC)
    if computer.now_s() < _CLOCK_IS_SET_S:
        text = f"the clock says {now:%Y-%m-%d}: it is not set, so ages of files, and the log's times, are wrong"
        yield Finding("computer", Level.NOTE, text, "sudo timedatectl set-ntp true")
    else:
        yield Finding("computer", Level.OK, f"the clock says {now:%Y-%m-%d %H:%M} UTC")


def _broken(computer: Computer) -> Iterator[tuple[str, str]]:
    for module in _NEEDED:
        try:
            computer.load(module)
        except Exception as error:  # noqa: BLE001  a broken wheel may raise anything
            yield module, str(error) or type(error).__name__


def _on_arm(missing: list[str]) -> str:
    if "pyrealsense2" in missing and platform.machine() in {"aarch64", "arm64", "armv7l"}:
        return " (pyrealsense2 has no ready-made package for most Pythons on ARM)"
    return ""


def _memory(computer: Computer) -> Iterator[Finding]:
    table = dict(line.split(":", 1) for line in (computer.read("/proc/meminfo") or "").splitlines() if ":" in line)
    figures = [table.get(key, "").split()[:1] for key in ("MemTotal", "MemAvailable")]
    if not all(figures):
        return
    total_kb, free_kb = (int(figure[0]) for figure in figures)
    text = f"{free_kb / 1e6:.1f} of {total_kb / 1e6:.1f} GB of memory free"
    if free_kb >= _LEAST_MEMORY_KB:
        yield Finding("computer", Level.OK, text)
    else:
        yield Finding("computer", Level.NOTE, f"{text}, touchd takes 0.12", "end other programs")


def _processor(computer: Computer) -> Iterator[Finding]:
    lines = (computer.read("/proc/cpuinfo") or "").splitlines()
    cores = sum(line.startswith("processor") for line in lines)
    governor, driver = computer.read(f"{_CPUFREQ}/scaling_governor"), computer.read(f"{_CPUFREQ}/scaling_driver")
    text = f"{cores or '?'} processor core{'s' * (cores != 1)}{'' if governor is None else f', governor {governor}'}"
    if governor == "powersave" and driver not in _OWN_GOVERNORS:
        remedy = "sudo cpupower frequency-set -g schedutil; touchd bench tells whether this machine is fast enough"
        yield Finding("computer", Level.NOTE, f"{text}: the processor stays at its lowest speed", remedy)
    elif cores == 1:
        yield Finding("computer", Level.NOTE, text, "touchd bench tells whether this machine is fast enough")
    else:
        yield Finding("computer", Level.OK, text)
