"""Finds and reads the config file: the outcome is a valid Config, or one ConfigError with every problem."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

from pydantic import ValidationError

from touchd.config.explain import explain
from touchd.config.problems import KeyPath, Mark, Problem, config_error, split_lines
from touchd.config.schema import Config
from touchd.config.yaml_marks import Document, UnreadableYamlError, read_yaml
from touchd.errors import ConfigError

SYSTEM_CONFIG = Path("/etc/touchd/touchd.yaml")
MAX_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a config came from: the file's name (None for the defaults) and the line of each key in it."""

    name: str | None
    lines: Mapping[KeyPath, int]


DEFAULTS = Origin(None, MappingProxyType({}))


def find_config_path(explicit: Path | None, env: Mapping[str, str], uid: int) -> Path | None:
    """Return the file to read, None where there is none and the defaults apply.

    ``explicit`` is what the command line names. Else, unless ``uid`` is 0, the user's own,
    ``$XDG_CONFIG_HOME/touchd/touchd.yaml`` (``~/.config`` where that is not set, as the XDG base directory
    specification says); else the system's.
    Raises ConfigError where ``explicit`` does not exist.
    """
    if explicit is not None:
        if not _exists(explicit):
            raise ConfigError(f"There is no config file {explicit}; check the path given with --config.")
        return explicit
    users = None if uid == 0 else _users_config(env)
    return next((path for path in (users, SYSTEM_CONFIG) if path is not None and _exists(path)), None)


def load_config(path: Path | None) -> Config:
    """Return the config in a file, or the default config for None. Raises ConfigError."""
    return load_with_origin(path)[0]


def load_with_origin(path: Path | None) -> tuple[Config, Origin]:
    """Return what :func:`load_config` does, and where each of the values came from. Raises ConfigError."""
    if path is None:
        return Config(), DEFAULTS
    return _parse(_read(path), str(path), path.absolute().parent)


def parse_config(text: str, name: str) -> Config:
    """Return the config in ``text``; ``name`` is the file's, for messages and as the base of relative paths.

    Raises ConfigError.
    """
    return _parse(text, name, Path(name).parent)[0]


def _parse(text: str, name: str, folder: Path) -> tuple[Config, Origin]:
    try:
        document = read_yaml(text)
    except UnreadableYamlError as error:
        raise config_error(name, text, [error.problem]) from error
    content = {} if document.value is None else document.value
    try:
        config = Config.model_validate(content, context={"folder": folder})
    except ValidationError as error:
        problems = explain(error.errors(include_url=False), document)
        raise config_error(name, text, [*document.problems, *problems]) from error
    if document.problems:
        raise config_error(name, text, document.problems)
    return config, Origin(name, _lines(document))


def _lines(document: Document) -> Mapping[KeyPath, int]:
    return MappingProxyType({path: place.key.line for path, place in document.places.items()})


def _users_config(env: Mapping[str, str]) -> Path | None:
    folder = Path(env.get("XDG_CONFIG_HOME", ""))
    if not folder.is_absolute():  # the specification says to ignore it then
        home = env.get("HOME", "")
        if not home:
            return None
        folder = Path(home) / ".config"
    return folder / "touchd" / "touchd.yaml"


def _exists(path: Path) -> bool:
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:
        return True  # reading it will say what is in the way
    return True


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            content = file.read(MAX_BYTES + 1)
    except OSError as error:
        reason = error.strerror or "it cannot be opened"
        raise ConfigError(f"Cannot read the config file {path}: {reason}; check the path and its rights.") from error
    if len(content) > MAX_BYTES:
        raise ConfigError(f"The config file {path} is larger than 1 MiB; this is no config of touchd's.")
    try:
        return content.decode()
    except UnicodeDecodeError as error:
        above = split_lines(content[: error.start].decode())
        what = f"the byte 0x{content[error.start]:02x} is not UTF-8; save the file as UTF-8 text"
        mark = Mark(len(above), len(above[-1]) + 1)
        raise config_error(str(path), content.decode(errors="replace"), [Problem(mark, what)]) from error
