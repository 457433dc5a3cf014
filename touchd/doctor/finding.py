"""What the doctor finds, and how it is told."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum

from touchd.errors import ExitCode

_LABEL_WIDTH = 13
# Of several problems, the first of these that one has is the command's: without a config nothing else counts.
_GRAVEST_FIRST = (ExitCode.BAD_CONFIG, ExitCode.UNAVAILABLE, ExitCode.CANNOT_WRITE, ExitCode.TRY_AGAIN)


class Level(StrEnum):
    """How bad something is."""

    OK = "ok"
    NOTE = "note"  # worth knowing; touch works, or works for others
    PROBLEM = "problem"  # touch does not work


_MARKS = {Level.OK: "", Level.NOTE: "- ", Level.PROBLEM: "! "}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at. ``exit_code`` is what a problem makes of the command's."""

    section: str
    level: Level
    text: str
    remedy: str | None = None
    exit_code: ExitCode = ExitCode.UNAVAILABLE


def exit_code_of(findings: Sequence[Finding]) -> ExitCode:
    """Return 0 without a problem, else the code of the gravest one."""
    codes = {finding.exit_code for finding in findings if finding.level is Level.PROBLEM}
    return next((code for code in _GRAVEST_FIRST if code in codes), ExitCode.OK)


def report_lines(findings: Sequence[Finding]) -> list[str]:
    """Return the findings as lines for people: "!" marks a problem, "-" a note, an arrow what to do about it."""
    lines = []
    section = None
    for finding in findings:
        label = "" if finding.section == section else finding.section
        section = finding.section
        lines.append(f"{label:<{_LABEL_WIDTH}}{_MARKS[finding.level]}{finding.text}")
        if finding.remedy is not None:
            lines.append(f"{'':<{_LABEL_WIDTH}}  → {finding.remedy}")
    return [*lines, "", _verdict(findings)]


def report_json(findings: Sequence[Finding]) -> str:
    """Return the findings as JSON. Keys may be added, never renamed."""
    return json.dumps(
        {
            "exit_code": int(exit_code_of(findings)),
            "problems": _count(findings, Level.PROBLEM),
            "notes": _count(findings, Level.NOTE),
            "findings": [_as_json(finding) for finding in findings],
        },
        indent=2,
    )


def _as_json(finding: Finding) -> dict[str, object]:
    content = asdict(finding)
    if finding.level is not Level.PROBLEM:
        del content["exit_code"]
    return content


def _verdict(findings: Sequence[Finding]) -> str:
    problems, notes = _count(findings, Level.PROBLEM), _count(findings, Level.NOTE)
    beside = f", {notes} note{'s' * (notes != 1)}" if notes else ""
    if problems:
        return f"{problems} problem{'s' * (problems != 1)}{beside}"
    return f"no problem found{beside}"


def _count(findings: Sequence[Finding], level: Level) -> int:
    return sum(finding.level is level for finding in findings)
