"""The entry point: what must happen before numpy is imported happens here."""

import os
import sys

# One thread each: results must not depend on how work was split, and the daemon's threads are its own.
for _library in ("OPENBLAS", "OMP", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

from touchd.cli import run_command_line


def main() -> int:
    """Run the command line and return its exit code."""
    return run_command_line(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
