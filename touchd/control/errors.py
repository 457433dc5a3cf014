"""What can go wrong between a command and the daemon it talks to."""

from touchd.errors import ExitCode, TouchdError


class ControlError(TouchdError):
    """The control socket cannot be made or used."""

    exit_code = ExitCode.UNAVAILABLE


class NotRunning(ControlError):
    """No daemon listens there, or it went away."""


class Refused(TouchdError):
    """The daemon says no, with its own exit code."""

    def __init__(self, message: str, exit_code: int) -> None:
        super().__init__(message)
        known = exit_code in ExitCode.__members__.values()
        self.exit_code = ExitCode(exit_code) if known else ExitCode.BUG
