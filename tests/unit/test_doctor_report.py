import json

import pytest
from touchd.doctor.finding import Finding, Level, exit_code_of, report_json, report_lines
from touchd.errors import ExitCode

FINE = Finding("config", Level.OK, "the defaults")
REMARK = Finding("config", Level.NOTE, "a remark", "look")
DARK = Finding("power", Level.PROBLEM, "no power", "connect it")
BROKEN = Finding("config", Level.PROBLEM, "a bad config", None, ExitCode.BAD_CONFIG)


def test_the_report_marks_problems_and_notes_and_says_what_to_do() -> None:
    assert report_lines([FINE, REMARK, DARK]) == [
        "config       the defaults",
        "             - a remark",
        "               → look",
        "power        ! no power",
        "               → connect it",
        "",
        "1 problem, 1 note",
    ]


@pytest.mark.parametrize(
    ("findings", "verdict"),
    [
        ([], "no problem found"),
        ([REMARK], "no problem found, 1 note"),
        ([DARK, BROKEN, REMARK, REMARK], "2 problems, 2 notes"),
    ],
)
def test_the_last_line_counts_problems_and_notes(findings: list[Finding], verdict: str) -> None:
    assert report_lines(findings)[-1] == verdict


@pytest.mark.parametrize(
    ("findings", "code"),
    [([FINE, REMARK], 0), ([DARK], 69), ([DARK, BROKEN], 78), ([BROKEN, DARK], 78)],
)
def test_the_exit_code_is_that_of_the_gravest_problem(findings: list[Finding], code: int) -> None:
    assert exit_code_of(findings) == code


def test_the_report_is_there_as_json() -> None:
    assert json.loads(report_json([REMARK, DARK])) == {
        "exit_code": 69,
        "problems": 1,
        "notes": 1,
        "findings": [
            {"section": "config", "level": "note", "text": "a remark", "remedy": "look"},
            {"section": "power", "level": "problem", "text": "no power", "remedy": "connect it", "exit_code": 69},
        ],
    }


def test_a_text_that_is_no_proper_unicode_can_be_reported() -> None:
    assert "odd" in report_json([Finding("config", Level.OK, "odd \udcff name")])
