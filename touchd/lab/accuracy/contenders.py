"""Who takes part: touchd's methods, the baselines, and variants of them with other settings."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from touchd.config.load import parse_config
from touchd.config.schema import Config
from touchd.config.section import Section
from touchd.contacts.methods import method_names
from touchd.errors import ConfigError, UsageError
from touchd.lab.accuracy.ranges import values_of
from touchd.lab.baselines import BASELINES

_BASELINE_METHOD = "shell"


@dataclass(frozen=True, slots=True)
class Contender:
    """A touch method with its settings, and the baseline through which it sees the surface, if any."""

    name: str
    method: str
    baseline: str | None = None
    setting: tuple[str, str] | None = None  # a config key such as "touch.far_mm", and its value as YAML

    def config(self) -> Config:
        """Return its config: the defaults but for the setting. Raises ConfigError for a setting that cannot be."""
        if self.setting is None:
            return Config()
        path, value = self.setting
        *sections, key = path.split(".")
        keys: dict[str, Any] = {key: json.loads(value)}
        for section in reversed(sections):
            keys = {section: keys}
        return parse_config(json.dumps(keys), f"--sweep {path}={value}")


def contenders(methods: Sequence[str], sweep: str | None) -> tuple[Contender, ...]:
    """Return those with these names (all if there are none), each once for every value of the sweep.

    ``sweep``: KEY=FIRST:LAST:STEP or KEY=VALUE,VALUE; KEY is a key of the config, or its end if that is enough to know
    it. Raises UsageError.
    """
    known = {name: Contender(name, name) for name in method_names()}
    known |= {name: Contender(name, _BASELINE_METHOD, name) for name in BASELINES}
    for name in methods:
        if name not in known:
            raise UsageError(f"--methods: there is no method {name!r}; choose from {', '.join(known)}")
    chosen = tuple(known[name] for name in methods or known)
    return chosen if sweep is None else tuple(one for each in chosen for one in _swept(each, sweep))


def _swept(contender: Contender, sweep: str) -> list[Contender]:
    key, equals, text = sweep.partition("=")
    if not equals:
        raise UsageError(f"--sweep: expected KEY=FIRST:LAST:STEP such as far_mm=8:20:1, found {sweep!r}")
    path = _config_path(key)
    variants = [
        Contender(f"{contender.name} {key}={value}", contender.method, contender.baseline, (path, _as_json(value)))
        for value in values_of(text, "--sweep")
    ]
    for variant in variants:
        try:
            variant.config()
        except ConfigError as error:
            raise UsageError(str(error)) from error
    return variants


def _as_json(value: str) -> str:
    try:
        json.loads(value)
    except ValueError:
        return json.dumps(value)
    return value


def _config_path(key: str) -> str:
    """Return the whole path of a config key of which the end is given."""
    paths = [path for path in _paths(Config(), "") if path == key or path.endswith(f".{key}")]
    if len(paths) == 1:
        return paths[0]
    found = f"could be {' or '.join(paths)}: give more of it" if paths else "is no key of the config"
    raise UsageError(f"--sweep: {key!r} {found}; touchd show-config lists the keys")


def _paths(section: Section, before: str) -> list[str]:
    paths = []
    for name in type(section).model_fields:
        value = getattr(section, name)
        paths += _paths(value, f"{before}{name}.") if isinstance(value, Section) else [f"{before}{name}"]
    return paths
