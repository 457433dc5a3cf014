"""The names of the contact methods there are: our own two, and those that installed packages bring."""

from importlib.metadata import entry_points

GROUP = "touchd.methods"
OWN_NAMES = ("fingertip", "shell")


def method_names() -> list[str]:
    """Return the names that ``touch.method`` may have: our own first, then those of installed packages."""
    installed = {entry.name for entry in entry_points(group=GROUP)}
    return [*OWN_NAMES, *sorted(installed.difference(OWN_NAMES))]
