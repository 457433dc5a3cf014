"""Who is who: the best pairing of expected and seen positions over all pairs.

Written here because scipy would cost 140 MB for this one function, and there are at most some sixty contacts.
"""

import numpy as np
from numpy.typing import NDArray

Costs = NDArray[np.float64]


def assign(costs: Costs, limit: float) -> list[tuple[int, int]]:
    """Return pairs (row, column) that minimise the sum of costs, where leaving a row unpaired costs ``limit``.

    ``costs`` is (R, C) float64, not negative; pairs at or above ``limit`` are never made. Each row and column is in
    one pair at most; pairs come in the order of their rows. The pairs fall into groups that do not touch each other,
    and each group is solved by itself (most hold one row and one column).
    """
    easy = _everyones_nearest(costs, limit)
    if easy is not None:
        return easy
    pairs: list[tuple[int, int]] = []
    for rows, columns in _groups(costs < limit):
        if len(rows) == 1 and len(columns) == 1:
            pairs.append((rows[0], columns[0]))
        else:
            pairs += [(rows[i], columns[j]) for i, j in _solve(costs[np.ix_(rows, columns)], limit)]
    return sorted(pairs)


def _everyones_nearest(costs: Costs, limit: float) -> list[tuple[int, int]] | None:
    """Return the pairs of each row with its cheapest column if no two rows want the same one: nothing can be better."""
    if not costs.size:
        return []
    nearest = costs.argmin(axis=1).tolist()
    pairs = [(row, column) for row, column in enumerate(nearest) if costs[row, column] < limit]
    return pairs if len({column for _, column in pairs}) == len(pairs) else None


def _groups(possible: NDArray[np.bool_]) -> list[tuple[list[int], list[int]]]:
    """Return the connected parts of the graph of possible pairs, as (rows, columns), smallest row first."""
    by_row = [np.flatnonzero(row).tolist() for row in possible]
    by_column = [np.flatnonzero(column).tolist() for column in possible.T]
    seen: set[int] = set()
    groups = []
    for start, choices in enumerate(by_row):
        if start in seen or not choices:
            continue
        rows, columns, waiting = {start}, set[int](), [start]
        while waiting:
            for column in by_row[waiting.pop()]:
                if column not in columns:
                    columns.add(column)
                    fresh = set(by_column[column]) - rows
                    rows |= fresh
                    waiting += fresh
        seen |= rows
        groups.append((sorted(rows), sorted(columns)))
    return groups


def _solve(costs: Costs, limit: float) -> list[tuple[int, int]]:
    """Solve one group by shortest augmenting paths with potentials (the Hungarian method).

    Each row gets a column of its own that means "unpaired" and costs ``limit``, so that a full assignment exists.
    """
    rows, real = costs.shape
    far = 2.0 * limit * (rows + 1) + 1.0
    table = np.full((rows, real + rows), far)
    table[:, :real] = np.where(costs < limit, costs, far)
    table[np.arange(rows), real + np.arange(rows)] = limit
    row_price, column_price = np.zeros(rows), np.zeros(real + rows)
    owner = np.full(real + rows, -1)
    for row in range(rows):
        _augment(row, table, row_price, column_price, owner)
    return [(int(owner[column]), column) for column in range(real) if owner[column] >= 0]


def _augment(row: int, table: Costs, row_price: Costs, column_price: Costs, owner: NDArray[np.int_]) -> None:
    """Give ``row`` a column along the cheapest alternating path; updates prices and owners in place."""
    columns = table.shape[1]
    distance = np.full(columns, np.inf)
    came_from = np.full(columns, -1)
    done = np.zeros(columns, bool)
    current_row, current_column, travelled = row, -1, 0.0
    while True:
        reach = travelled + table[current_row] - row_price[current_row] - column_price
        better = ~done & (reach < distance)
        distance[better] = reach[better]
        came_from[better] = current_column
        open_distance = np.where(done, np.inf, distance)
        current_column = int(np.argmin(open_distance))
        travelled = float(open_distance[current_column])
        done[current_column] = True
        if owner[current_column] < 0:
            break
        current_row = int(owner[current_column])
    row_price[row] += travelled
    for column in np.flatnonzero(done):
        if column != current_column:
            gain = travelled - distance[column]
            row_price[owner[column]] += gain
            column_price[column] -= gain
    while current_column >= 0:
        previous = int(came_from[current_column])
        owner[current_column] = row if previous < 0 else owner[previous]
        current_column = previous
