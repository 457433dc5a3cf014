"""What a TUIO client saw, and how that compares with what was published.

What was published is a list of event objects as ``TouchFrame.as_event()`` makes them, or as they are read
back from an events file.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

Point = tuple[float, float]


@dataclass(slots=True)
class ClientLog:
    """What a client saw, by session id on the wire."""

    adds: list[int] = field(default_factory=list)
    moves: dict[int, list[Point]] = field(default_factory=dict)  # positions, the first one too
    removes: list[int] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)  # what the client complained of

    def add(self, session_id: int, position: Point) -> None:
        self.adds.append(session_id)
        self.move(session_id, position)

    def move(self, session_id: int, position: Point) -> None:
        self.moves.setdefault(session_id, []).append(position)

    def remove(self, session_id: int) -> None:
        self.removes.append(session_id)

    def left_over(self) -> set[int]:
        """Return the ids that the client still holds."""
        return set((Counter(self.adds) - Counter(self.removes)).elements())


def published_paths(events: Iterable[Mapping[str, Any]]) -> dict[int, list[Point]]:
    """Return every published cursor's positions in order, by the core's session id."""
    paths: dict[int, list[Point]] = {}
    for event in events:
        for cursor in event["cursors"]:
            paths.setdefault(cursor["id"], []).append((cursor["x"], cursor["y"]))
    return paths


def learned_offset(log: ClientLog, events: Iterable[Mapping[str, Any]]) -> int:
    """Return the sender's session offset, from the lowest id on either side."""
    return min(log.adds, default=0) - min(published_paths(events), default=0)


def wire_paths(events: Iterable[Mapping[str, Any]], session_offset: int) -> dict[int, list[Point]]:
    """Return every published cursor's positions in order, by its session id on the wire."""
    return {session_offset + core_id: path for core_id, path in published_paths(events).items()}


def differences(
    log: ClientLog, events: Iterable[Mapping[str, Any]], session_offset: int, tolerance: float = 1e-3
) -> list[str]:
    """Return one sentence for each way in which the client saw other touches than those published.

    None means: each cursor was added once, went through all its positions in order within ``tolerance`` and
    through no other, and was removed once. How often a client repeats a position is its own affair. Up to 60
    cursors at a time can be compared, as no more are sent.
    """
    published = wire_paths(events, session_offset)
    found = _broken_lives(log, published, published)
    for i in sorted(set(published) & set(log.moves)):
        if not _same_path(log.moves[i], published[i], tolerance):
            found.append(f"Cursor {i} was published along {published[i]} but seen along {log.moves[i]}.")
    return found


def contradictions(
    log: ClientLog, published: Mapping[int, Sequence[Point]], required: Collection[int], tolerance: float = 1e-3
) -> list[str]:
    """Return the same for a client that could not get every datagram; ``published`` and ``required`` are by wire id.

    None means: it saw each cursor of ``required`` and others of ``published`` or not, each added once, at positions
    that the cursor had, in their order, and removed once.
    """
    found = _broken_lives(log, published, {*required, *log.adds, *log.removes} & set(published))
    for i in sorted(set(published) & set(log.moves)):
        if not _is_part(log.moves[i], published[i], tolerance):
            found.append(f"Cursor {i} was published along {published[i]} but seen along {log.moves[i]}.")
    return found


def lasting_faults(
    log: ClientLog, published: Mapping[int, Sequence[Point]], required: Collection[int], tolerance: float = 1e-3
) -> list[str]:
    """Return the same for a client that takes late datagrams for new ones, and so goes back for a frame.

    None means: it saw each cursor of ``required`` and others of ``published`` or not, only at positions that the
    cursor had at some time, and removed each as often as it had added it.
    """
    found = list(log.faults)
    found += [f"Cursor {i} was never added." for i in sorted(set(required) - set(log.adds))]
    found += [f"Cursor {i} was never published." for i in sorted({*log.adds, *log.removes} - set(published))]
    found += [f"Cursor {i} was left over." for i in sorted(log.left_over())]
    for i in sorted(set(published) & set(log.moves)):
        strange = [at for at in log.moves[i] if not any(_near(at, known, tolerance) for known in published[i])]
        found += [f"Cursor {i} was seen at {at}, where it never was." for at in strange]
    return found


def _broken_lives(log: ClientLog, published: Collection[int], expected: Collection[int]) -> list[str]:
    found = list(log.faults)
    for verb, ids in (("added", log.adds), ("removed", log.removes)):
        times = Counter(ids)
        found += [f"Cursor {i} was {verb} {times[i]} times." for i in sorted(expected) if times[i] != 1]
        found += [f"Cursor {i} was {verb} but never published." for i in sorted(set(ids) - set(published))]
    return found


def _is_part(seen: Sequence[Point], published: Sequence[Point], tolerance: float) -> bool:
    """Return whether ``seen`` goes through points of ``published`` in their order, whichever it leaves out."""
    k = 0
    for point in seen:
        while k < len(published) and not _near(published[k], point, tolerance):
            k += 1
    return k < len(published)


def _same_path(seen: Sequence[Point], published: Sequence[Point], tolerance: float) -> bool:
    """Return whether both go through the same points in the same order, whichever repeats some of them."""
    reached = {-1}
    for point in seen:
        reached = {k for j in reached for k in _reach(published, j, point, tolerance)}
    return len(published) - 1 in reached


def _reach(published: Sequence[Point], last: int, point: Point, tolerance: float) -> Iterator[int]:
    repeats = last >= 0 and _near(published[last], point, tolerance)
    k = last if repeats else last + 1
    while k < len(published) and _near(published[k], point, tolerance):
        yield k
        k += 1


def _near(a: Point, b: Point, tolerance: float) -> bool:
    return abs(a[0] - b[0]) <= tolerance and abs(a[1] - b[1]) <= tolerance
