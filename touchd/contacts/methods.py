"""From a contact method's name to what makes it."""

from importlib.metadata import entry_points

from touchd.contacts.fingertip import FingertipMethod
from touchd.contacts.method import MakesMethod
from touchd.contacts.names import GROUP, method_names
from touchd.contacts.shell_method import ShellMethod
from touchd.errors import ConfigError

__all__ = ["OWN_METHODS", "method_maker", "method_names"]

OWN_METHODS: dict[str, MakesMethod] = {"fingertip": FingertipMethod, "shell": ShellMethod}


def method_maker(name: str) -> MakesMethod:
    """Return what makes the method of a name. Raises ConfigError for one that nobody brings."""
    if name in OWN_METHODS:
        return OWN_METHODS[name]
    for entry in entry_points(group=GROUP, name=name):
        maker: MakesMethod = entry.load()
        return maker
    raise ConfigError(
        f"touch.method: there is no method {name!r}; choose one of {', '.join(method_names())}, or install the package "
        "that brings it"
    )
