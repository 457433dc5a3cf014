"""`python -m touchd.lab.report docs accuracy.json`: docs/accuracy.md's tables, chart and pictures, anew."""

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from touchd.errors import TouchdError
from touchd.lab.report.document import write_report


def main(arguments: Sequence[str]) -> int:
    """Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m touchd.lab.report", description=__doc__)
    parser.add_argument("docs", type=Path, help="the folder of accuracy.md; what lies outside of its marks stays")
    parser.add_argument("results", type=Path, help="what touchd bench accuracy --json printed")
    options = parser.parse_args(arguments)
    try:
        for path in write_report(options.docs, json.loads(options.results.read_text(encoding="utf-8"))):
            sys.stdout.write(f"{path}\n")
    except TouchdError as error:
        sys.stderr.write(f"{error}\n")
        return int(error.exit_code)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
