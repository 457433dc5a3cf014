"""`make soak`: 24 hours of frames through the daemon as fast as they go, with a report every simulated hour."""

import argparse
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import touchd.__main__  # noqa: F401  as for touchd itself, it must come before numpy: it keeps that to one thread

from soak.client import StrictClient
from soak.day import Clients, Plan, opened_day
from soak.verdict import HEADING, leaks


def soak(plan: Plan, say: Callable[[str], None]) -> list[str]:
    """Run the day, say each sample, and return a sentence for each thing that was wrong."""
    with tempfile.TemporaryDirectory() as folder, StrictClient() as regular, StrictClient() as guest:
        clients = Clients(regular, guest)
        samples = []
        say(HEADING)
        with opened_day(Path(folder), clients) as day:
            for sample in day.samples(plan):
                samples.append(sample)
                say(sample.line())
            found = [*leaks(samples), *day.complaints()]
        for client in (regular, guest):
            client.catch_up()
            say(client.summary())
            found += client.verdict()
    return found


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main() -> int:
    """Return 0 if all was well in the end."""
    parser = argparse.ArgumentParser(prog="soak", description=__doc__)
    parser.add_argument("--minutes", type=int, default=24 * 60, help="length of the day, simulated (default 24 h)")
    parser.add_argument("--sample-minutes", type=int, default=60, help="time between two reports, simulated")
    options = parser.parse_args()
    if options.minutes < 2 * options.sample_minutes:
        parser.error("one sample tells nothing: give at least twice as many --minutes as --sample-minutes")
    found = soak(Plan(options.minutes, options.sample_minutes), _say)
    for sentence in found:
        _say(f"WRONG: {sentence}")
    _say("soak: nothing was wrong" if not found else f"soak: {len(found)} things were wrong")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
