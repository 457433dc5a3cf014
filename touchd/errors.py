"""The error family: what can go wrong in ways that a user can act on, and the exit code of each.

Anything that is not a :class:`TouchdError` is a bug: it ends in a traceback and exit code 70.
"""

from enum import IntEnum


class ExitCode(IntEnum):
    """Exit codes of every command (sysexits.h); other programs rely on them."""

    OK = 0
    USAGE = 64
    BAD_DATA = 65
    UNAVAILABLE = 69
    BUG = 70
    CANNOT_WRITE = 73
    TRY_AGAIN = 75
    BAD_CONFIG = 78


class TouchdError(Exception):
    """Base of all expected errors. The message is one sentence: what, where, value found, what to do."""

    exit_code = ExitCode.BUG


class UsageError(TouchdError):
    """The command line asks for something that makes no sense."""

    exit_code = ExitCode.USAGE


class ConfigError(TouchdError):
    """The config file cannot be used."""

    exit_code = ExitCode.BAD_CONFIG


class SourceError(TouchdError):
    """The source of frames cannot be opened or has failed."""

    exit_code = ExitCode.UNAVAILABLE


class RecordingError(SourceError):
    """A recording is missing, damaged, or not of a format that we read."""

    exit_code = ExitCode.BAD_DATA


class DeviceNotFound(SourceError):
    """No such camera is plugged in."""


class DeviceDenied(SourceError):
    """The system does not let us use the camera."""


class DeviceBusy(SourceError):
    """Another program or driver holds the camera."""


class DeviceLost(SourceError):
    """The camera went away, or stopped to answer or to send, while it was in use."""


class CalibrationError(TouchdError):
    """The empty surface could not be learned."""

    exit_code = ExitCode.TRY_AGAIN


class StateError(TouchdError):
    """A stored surface or counter is damaged, or belongs to another camera or version."""

    exit_code = ExitCode.BAD_DATA


class StateNotKept(StateError):
    """The state folder cannot be written to."""

    exit_code = ExitCode.CANNOT_WRITE


class AlreadyRunning(TouchdError):
    """Another daemon uses the same state folder."""

    exit_code = ExitCode.TRY_AGAIN


class OutputError(TouchdError):
    """An output cannot be opened or written to."""

    exit_code = ExitCode.CANNOT_WRITE
