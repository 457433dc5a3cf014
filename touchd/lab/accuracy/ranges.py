"""How lists and ranges on the command line are read."""

from decimal import Decimal, InvalidOperation

from touchd.errors import UsageError

_MOST = 200


def names_of(text: str | None) -> tuple[str, ...]:
    """Return the names in a list apart by commas; none for None."""
    return tuple(name.strip() for name in text.split(",") if name.strip()) if text else ()


def values_of(text: str, option: str) -> list[str]:
    """Return the values of FIRST:LAST:STEP (both ends included) or of VALUE,VALUE,…; UsageError for anything else."""
    if ":" not in text:
        values = [value.strip() for value in text.split(",")]
        if "" in values:
            raise UsageError(f"{option}: a value is missing in {text!r}")
        return values
    try:
        first, last, step = (Decimal(part) for part in text.split(":"))
        count = int((last - first) / step) + 1
    except (ValueError, InvalidOperation, ZeroDivisionError) as error:
        raise UsageError(f"{option}: expected FIRST:LAST:STEP in numbers such as 8:20:1, found {text!r}") from error
    if not 1 <= count <= _MOST:
        raise UsageError(f"{option}: {text!r} has {max(count, 0)} values; expected 1 to {_MOST}")
    return [f"{(first + step * i).normalize():f}" for i in range(count)]


def heights_of(text: str) -> tuple[float, ...]:
    """Return the camera's heights in mm; UsageError for what is no height from 400 to 4000."""
    try:
        heights = tuple(float(value) for value in values_of(text, "--heights"))
    except ValueError:
        heights = ()
    if not heights or not all(400.0 <= height <= 4000.0 for height in heights):
        raise UsageError(f"--heights: expected heights of 400 to 4000 mm such as 750,1500, found {text!r}")
    return heights


def seeds_of(text: str) -> tuple[int, ...]:
    """Return the seeds of FIRST-LAST or of SEED,SEED,…; UsageError for anything else."""
    first, dash, last = text.partition("-")
    parts = [first, last] if dash else text.split(",")
    if not all(part.isascii() and part.isdigit() and len(part) <= 9 for part in parts):
        raise UsageError(f"--seeds: expected seeds such as 101-105 or 1,7,9, found {text!r}")
    seeds = tuple(range(int(first), int(last) + 1)) if dash else tuple(int(part) for part in parts)
    if not 1 <= len(seeds) <= _MOST:
        raise UsageError(f"--seeds: {text!r} has {len(seeds)} seeds; expected 1 to {_MOST}")
    return seeds
