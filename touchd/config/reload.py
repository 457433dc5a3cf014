"""What a new config changes in a running daemon."""

from dataclasses import dataclass

from touchd.config.describe import all_keys, extra, field_at, section_at
from touchd.config.problems import KeyPath, dotted
from touchd.config.schema import Config


@dataclass(frozen=True, slots=True)
class Changes:
    """The keys whose values differ, dotted, by what a change of them needs."""

    live: tuple[str, ...]
    source: tuple[str, ...]  # the source is opened anew
    restart: tuple[str, ...]  # in force after the next start

    def sentence(self) -> str:
        """Return what was changed and what becomes of it."""
        parts = []
        if self.live or self.source:
            parts.append(f"in force now: {', '.join((*self.source, *self.live))}")
        if self.restart:
            parts.append(f"in force after a restart: {', '.join(self.restart)}")
        return "; ".join(parts) or "nothing changed"


def changes(old: Config, new: Config) -> Changes:
    """Return what differs between two configs."""
    differing = [path for path in _leaves() if _value(old, path) != _value(new, path)]
    by_tag = {tag: tuple(dotted(path) for path in differing if _tag(path) == tag) for tag in _TAGS}
    return Changes(live=by_tag["live"], source=by_tag["source"], restart=by_tag["restart"])


_TAGS = ("live", "source", "restart")


def _leaves() -> list[KeyPath]:
    """Return the keys to compare one by one; lists and the area are compared as a whole."""
    return [path for path in all_keys() if _comparable(path)]


def _comparable(path: KeyPath) -> bool:
    whole = ("area",), ("outputs",)
    return path in whole or (section_at(path) is None and path[:1] not in whole)


def _tag(path: KeyPath) -> str:
    field = field_at(path)
    return extra(field, "reload") if field is not None else "live"


def _value(config: Config, path: KeyPath) -> object:
    value: object = config
    for name in path:
        value = getattr(value, str(name))
    return value
