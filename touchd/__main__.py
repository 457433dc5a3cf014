"""The entry point: what must happen before anything else is imported happens here."""

import os
import signal
import sys

# `run` and `demo` wait for these in the main thread; blocked before numpy's import, its threads cannot take them.
WAITED_FOR = (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGHUP)
if sys.argv[1:2] in (["run"], ["demo"]):
    signal.pthread_sigmask(signal.SIG_BLOCK, WAITED_FOR)

# One thread each: results must not depend on how work was split, and the daemon's threads are its own.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

from touchd.memory import share_one_heap

share_one_heap()

from touchd.cli import run_command_line


def main() -> int:
    """Run the command line and return its exit code."""
    return run_command_line(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
