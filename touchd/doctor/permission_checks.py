"""Findings about who may use the camera: the udev rule, the group, the service's user."""

from collections.abc import Iterator

from touchd.doctor.computer import Computer
from touchd.doctor.depth_cameras import PluggedKinect
from touchd.doctor.finding import Finding, Level
from touchd.doctor.survey import Survey
from touchd.doctor.use import Use, use_of

_GROUP = "touchd"  # systemd/touchd.sysusers.conf
_RULE = "60-touchd.rules"
_RULE_FOLDERS = (
    "/etc/udev/rules.d",
    "/run/udev/rules.d",
    "/usr/local/lib/udev/rules.d",
    "/usr/lib/udev/rules.d",
    "/lib/udev/rules.d",
)
_UNIT_FOLDERS = ("/etc/systemd/system", "/usr/local/lib/systemd/system", "/usr/lib/systemd/system")
_SYSUSERS = "sudo systemd-sysusers"
_RELOAD = "sudo udevadm control --reload && sudo udevadm trigger --subsystem-match=usb"


def permission(computer: Computer, found: Survey) -> Iterator[Finding]:
    """Say whether this user, and the service, may use the cameras that are there."""
    yield _rule(computer)
    yield from _service(computer)
    for kinect in found.plugged.kinects:
        yield _of_camera(computer, found, kinect)


def _rule(computer: Computer) -> Finding:
    path = _installed_rule(computer)
    if path is None:
        text = "touchd's udev rule is not installed, so only root and whoever the system chose may use a Kinect"
        return Finding("permission", Level.NOTE, text, "sudo make install, in touchd's folder")
    if computer.group_id(_GROUP) is None:
        text = f"{path} gives Kinects to the group {_GROUP}, which does not exist"
        return Finding("permission", Level.NOTE, text, _SYSUSERS)
    return Finding("permission", Level.OK, f"{path} gives Kinects to the group {_GROUP}")


def _service(computer: Computer) -> Iterator[Finding]:
    units = [f"{folder}/touchd.service" for folder in _UNIT_FOLDERS if computer.exists(f"{folder}/touchd.service")]
    if units and not computer.has_user(_GROUP):
        yield Finding("permission", Level.PROBLEM, f"{units[0]} runs as user {_GROUP}, who does not exist", _SYSUSERS)


def _of_camera(computer: Computer, found: Survey, kinect: PluggedKinect) -> Finding:
    node = kinect.camera.node
    if not computer.exists(node):
        text = f"{kinect.camera.place} has no file {node} here, through which programs use it"
        return Finding("permission", Level.PROBLEM, text, "in a container: pass /dev/bus/usb and /sys in")
    if computer.may_use(computer.at(node)):
        who = "root" if computer.uid == 0 else "you"
        return Finding("permission", Level.OK, f"{who} may use {node}, the camera at {kinect.camera.place}")
    level = Level.NOTE if found.runs or use_of(computer, found, kinect).use is Use.TOUCHD else Level.PROBLEM
    text = f"you may not use {node}, the camera at {kinect.camera.place}"
    return Finding("permission", level, text, _remedy(computer, node))


def _remedy(computer: Computer, node: str) -> str:
    group_id = computer.group_id(_GROUP)
    if _installed_rule(computer) is None:
        return f"sudo make install, in touchd's folder; then become a member: {_join(computer)}"
    if group_id is None:
        return f"{_SYSUSERS} && {_RELOAD}"
    if computer.owning_group(node) != group_id:
        return f"the rule has not been applied: unplug the Kinect and plug it in again, or {_RELOAD}"
    if computer.is_member(_user(computer), _GROUP):
        return f"you are a member of the group {_GROUP} from the next login on: log out and in again"
    return _join(computer)


def _join(computer: Computer) -> str:
    return f"sudo usermod -aG {_GROUP} {_user(computer)}, then log out and in again"


def _user(computer: Computer) -> str:
    return computer.env.get("USER", "YOUR-NAME")


def _installed_rule(computer: Computer) -> str | None:
    paths = (f"{folder}/{_RULE}" for folder in _RULE_FOLDERS)
    return next((path for path in paths if computer.exists(path)), None)
