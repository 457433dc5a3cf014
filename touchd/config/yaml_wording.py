"""Our own sentences for YAML that cannot be read."""

import yaml

from touchd.config.problems import Mark, Problem

_DIRECTIVE = "a line that begins with '%' has no meaning here; remove it"
# A fragment of PyYAML's wording; whether the trouble began earlier, at its "context mark"; our sentence.
_SENTENCES = (
    (
        "found character '\\t'",
        False,
        "a tab where only spaces may stand; indent and separate with spaces",
    ),
    (
        "that cannot start any token",
        False,
        "a value cannot begin with this character; put the value in quotes",
    ),
    ("could not find expected ':'", True, "no ':' follows this; write 'key: value'"),
    (
        "mapping values are not allowed",
        False,
        "this ':' fits nowhere; check the indentation and the line above, and quote text that holds ': '",
    ),
    (
        "sequence entries are not allowed",
        False,
        "a list item cannot begin here; put each '- ' on a line of its own",
    ),
    ("mapping keys are not allowed", False, "a '?' cannot stand here; put the value in quotes"),
    ("unexpected end of stream", True, "the quote opened here is never closed"),
    ("unexpected document separator", True, "the quote opened here is never closed"),
    (
        "expected <block end>",
        False,
        "this fits nothing above it; check the indentation, quotes and brackets of this line",
    ),
    (
        "expected ',' or ']'",
        False,
        "the list opened in line {line} breaks here; put ',' between its items and ']' after the last",
    ),
    (
        "expected ',' or '}'",
        False,
        "the group opened in line {line} breaks here; put ',' between its keys and '}}' after the last",
    ),
    ("expected the node content", False, "a value is missing before this, or this is one too many"),
    (
        "unknown escape character",
        False,
        "no such escape in double quotes; use single quotes, or '\\\\' for a backslash",
    ),
    (
        "expected escape sequence",
        False,
        "no such escape in double quotes; use single quotes, or '\\\\' for a backslash",
    ),
    (
        "<document start>",
        False,
        "the config has ended before this; check the brackets above, and the indentation",
    ),
    ("scanning a directive", True, _DIRECTIVE),
    ("YAML document", False, _DIRECTIVE),
    ("YAML directive", False, _DIRECTIVE),
    ("tag handle", False, "'!' begins a YAML tag; put the value in quotes"),
    ("scanning an a", True, "'&' and '*' begin a YAML anchor or alias; put the value in quotes"),
    ("a tag", True, "'!' begins a YAML tag; put the value in quotes"),
    ("scanning a block scalar", True, "after '|' or '>' the text begins on the next line"),
)


def yaml_problem(error: yaml.MarkedYAMLError) -> Problem:
    """Return what PyYAML found wrong as one of our sentences, at the place where a person would mend it."""
    context, found = error.context_mark, error.problem_mark
    wording = f"{error.context}: {error.problem}"
    opened = 1 if context is None else context.line + 1
    for fragment, began_earlier, sentence in _SENTENCES:
        if fragment in wording:
            return Problem(_mark(context if began_earlier and context else found), sentence.format(line=opened))
    return Problem(_mark(found or context), "this is not valid YAML; check the quotes and the indentation")


def _mark(mark: yaml.Mark | None) -> Mark:
    return Mark(1, 1) if mark is None else Mark(mark.line + 1, mark.column + 1)
