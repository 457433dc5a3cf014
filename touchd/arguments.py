"""How the command line's words are read: each reader returns a value or says what it expected."""

import argparse


def speed(text: str) -> float | None:
    """Read N or "max" (None): how many times a recording's clock to play at."""
    if text == "max":
        return None
    try:
        times = float(text)
    except ValueError:
        times = 0.0
    if not 0.0 < times < 1e6:
        raise argparse.ArgumentTypeError(f"expected a number above 0 or 'max', found {text!r}")
    return times


def paced_seconds(text: str) -> float:
    """Read the length of a paced run in seconds."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.5 <= seconds <= 600.0:
        raise argparse.ArgumentTypeError(f"expected 0.5 to 600 seconds, found {text!r}")
    return seconds


def udp_port(text: str) -> int:
    """Read a UDP port."""
    if not (text.isascii() and text.isdigit() and len(text) <= 5 and 1 <= int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"expected a port from 1 to 65535, found {text!r}")
    return int(text)


def count(text: str) -> int:
    """Read a number of things, at least one."""
    if not (text.isascii() and text.isdigit() and len(text) <= 9 and int(text) > 0):
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, found {text!r}")
    return int(text)


def positive_seconds(text: str) -> float:
    """Read a time in seconds above 0."""
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 0.0 < seconds < 1e9:
        raise argparse.ArgumentTypeError(f"expected a number of seconds above 0, found {text!r}")
    return seconds
