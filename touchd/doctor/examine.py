"""What ``touchd doctor`` does: looks at everything and finds what is in the way."""

from collections.abc import Callable, Iterator
from pathlib import Path

from touchd.doctor.camera_checks import in_use, kernel_driver, plugged_in, power
from touchd.doctor.computer import Computer
from touchd.doctor.finding import Finding
from touchd.doctor.machine_checks import machine, python
from touchd.doctor.output_checks import outputs
from touchd.doctor.permission_checks import permission
from touchd.doctor.setup_checks import config, daemon, surface
from touchd.doctor.survey import Survey, survey
from touchd.doctor.usb_checks import autosuspend, bandwidth, controllers, usb_memory

Check = Callable[[Computer, Survey], Iterator[Finding]]

CHECKS: tuple[Check, ...] = (
    config,
    daemon,
    plugged_in,
    power,
    permission,
    kernel_driver,
    in_use,
    usb_memory,
    controllers,
    bandwidth,
    autosuspend,
    surface,
    outputs,
    python,
    machine,
)


def examine(computer: Computer, config_path: Path | None, socket: Path | None) -> tuple[Finding, ...]:
    """Look at a computer; ``config_path`` and ``socket`` are what the command line names. Changes nothing."""
    found = survey(computer, config_path, socket)
    return tuple(finding for check in CHECKS for finding in check(computer, found))
