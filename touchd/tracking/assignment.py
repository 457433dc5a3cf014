"""Who is who: the best pairing of expected and seen positions over all pairs.

Written here because scipy would cost 140 MB for this one function. At most some sixty contacts, of which each is near
a few others only, so the costs are sparse and plain Python beats numpy.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from heapq import heappop, heappush

Choices = Sequence[tuple[int, float]]


def assign(choices: Sequence[Choices], limit: float) -> list[tuple[int, int]]:
    """Return pairs (row, column) that minimise the sum of costs, where leaving a row unpaired costs ``limit``.

    ``choices`` has for each row the columns (from 0) that it may be paired with, and what each costs: at least 0 and
    less than ``limit``. Each row and column is in one pair at most; pairs come in the order of their rows.

    Shortest augmenting paths with prices (the Hungarian method in the form of Jonker and Volgenant, 1987). Each row
    also has a column of its own, numbered below 0, that means "unpaired" and costs ``limit``, so that every row can be
    placed.
    """
    plan = _Plan([[(-1 - row, limit), *own] for row, own in enumerate(choices)])
    for row in range(len(choices)):
        plan.place(row)
    return sorted((row, column) for column, row in plan.owner.items() if column >= 0)


@dataclass(slots=True)
class _Plan:
    """Rows placed so far, at the least total cost; prices prove that it is the least."""

    choices: Sequence[Choices]  # by row: columns and their costs
    owner: dict[int, int] = field(default_factory=dict)  # row by column
    row_price: dict[int, float] = field(default_factory=dict)
    column_price: dict[int, float] = field(default_factory=dict)

    def place(self, row: int) -> None:
        """Place one more row, moving others where that is cheaper: Dijkstra's search for a free column."""
        self.row_price[row] = 0.0
        reached: dict[int, float] = {}
        came_from: dict[int, int] = {}
        settled: dict[int, float] = {}
        waiting: list[tuple[float, int]] = []
        current, travelled = row, 0.0
        while True:
            for column, cost in self.choices[current]:
                way = travelled + cost - self.row_price[current] - self.column_price.get(column, 0.0)
                if column not in settled and way < reached.get(column, math.inf):
                    reached[column], came_from[column] = way, current
                    heappush(waiting, (way, column))
            travelled, column = heappop(waiting)
            while column in settled:
                travelled, column = heappop(waiting)
            if column not in self.owner:
                break
            settled[column] = travelled
            current = self.owner[column]
        self._move_prices(row, travelled, settled)
        self._follow_back(row, column, came_from)

    def _move_prices(self, row: int, travelled: float, settled: dict[int, float]) -> None:
        self.row_price[row] += travelled
        for column, way in settled.items():
            self.row_price[self.owner[column]] += travelled - way
            self.column_price[column] = self.column_price.get(column, 0.0) - (travelled - way)

    def _follow_back(self, row: int, column: int, came_from: dict[int, int]) -> None:
        while (mover := came_from[column]) != row:
            left = next(held for held, owner in self.owner.items() if owner == mover)
            self.owner[column] = mover
            column = left
        self.owner[column] = row
