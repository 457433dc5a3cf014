"""`touchd lift`: ends the touches that clients still hold of a daemon that was killed."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack

from touchd.assemble import tuio_source
from touchd.config.output_sections import Tuio
from touchd.config.schema import Config
from touchd.errors import UsageError
from touchd.outputs.profiles import PROFILES
from touchd.outputs.tuio import TuioEncoder
from touchd.outputs.tuio_udp import TuioUdpOutput
from touchd.outputs.udp import UdpSender, parse_destination
from touchd.state import instance_of, state_folder

# Long enough for a name server nearby, and short beside the time that a service manager gives for stopping.
NAMES_S = 3.0


def lift(config: Config, to: Sequence[str], env: Mapping[str, str], names_s: float = NAMES_S) -> Iterator[str]:
    """Send the empty redundant TUIO bundle to every destination, and yield one line for each of them.

    ``to`` names destinations as HOST:PORT in place of the config's, unless it is empty. Some clients hold touches by
    the sender's name, so it is that of the daemon with this config and state folder (``env`` as in
    :func:`touchd.state.state_folder`). All names together are waited for up to ``names_s`` seconds. Nobody
    listening is no failure; a destination that cannot be sent to is told in its line.

    :raises UsageError: when a destination in ``to`` cannot be read.
    :raises OutputError: when the config's source name cannot be sent.
    """
    wanted = _wanted(config, to)
    if not wanted:
        yield "the config names no TUIO destination, so there is nothing to lift"
    instance = instance_of(state_folder(env))
    with ExitStack() as opened:
        senders = {each: opened.enter_context(UdpSender([each])) for each in wanted}  # all look up their names at once
        deadline_s = time.monotonic() + names_s
        for destination, (source, profile) in wanted.items():
            sender = senders[destination]
            sender.wait_resolved(max(0.0, deadline_s - time.monotonic()))
            name = tuio_source(source, instance, destination)
            encoder = TuioEncoder(name, session_offset=0, first_fseq=1, profile=PROFILES[profile])
            TuioUdpOutput(encoder, sender).start()
            yield _line(sender)


def _wanted(config: Config, to: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return the configured source name and profile by destination."""
    configured: dict[str, tuple[str, str]] = {
        destination: (item.tuio.source, item.tuio.profile)
        for item in config.outputs
        if item.tuio is not None
        for destination in item.tuio.to
    }
    for destination in to:
        try:
            parse_destination(destination)
        except ValueError as error:
            raise UsageError(f"--to: {error}") from error
    otherwise = Tuio().source, Tuio().profile
    return {destination: configured.get(destination, otherwise) for destination in to} or configured


def _line(sender: UdpSender) -> str:
    (status,) = sender.status()
    return status.last_error or f"{status.destination}: all touches lifted"
