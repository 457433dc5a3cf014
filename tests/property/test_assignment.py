from itertools import permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from touchd.tracking import assignment

LIMIT = 100.0


def assign(costs: NDArray[np.float64]) -> list[tuple[int, int]]:
    choices = [[(column, cost) for column, cost in enumerate(row) if cost < LIMIT] for row in costs.tolist()]
    return assignment.assign(choices, LIMIT)


def tables() -> st.SearchStrategy[NDArray[np.float64]]:
    # Small whole costs make ties and forbidden pairs frequent.
    return st.tuples(st.integers(0, 5), st.integers(0, 5), st.randoms(use_true_random=False)).map(
        lambda size: np.array(
            [[float(size[2].choice([0, 1, 5, 20, 60, 99, 100, 150])) for _ in range(size[1])] for _ in range(size[0])]
        ).reshape(size[0], size[1])
    )


def total(costs: NDArray[np.float64], pairs: list[tuple[int, int]]) -> float:
    return sum(float(costs[pair]) for pair in pairs) + LIMIT * (len(costs) - len(pairs))


def brute_force(costs: NDArray[np.float64]) -> float:
    rows, columns = costs.shape
    padded = np.full((rows, columns + rows), LIMIT)
    padded[:, :columns] = np.where(costs < LIMIT, costs, LIMIT)
    return min(
        (
            sum(padded[row, column] for row, column in enumerate(choice))
            for choice in permutations(range(columns + rows), rows)
        ),
        default=0.0,
    )


@settings(deadline=None, max_examples=150)
@given(tables())
def test_the_assignment_costs_as_little_as_the_best_of_all_assignments(costs: NDArray[np.float64]) -> None:
    if costs.shape[0] > 4:
        costs = costs[:4]
    assert total(costs, assign(costs)) == brute_force(costs)


@settings(deadline=None)
@given(tables())
def test_each_row_and_each_column_is_paired_once_at_most_and_never_at_or_above_the_limit(
    costs: NDArray[np.float64],
) -> None:
    pairs = assign(costs)
    assert len({row for row, _ in pairs}) == len(pairs)
    assert len({column for _, column in pairs}) == len(pairs)
    assert all(costs[pair] < LIMIT for pair in pairs)
    assert pairs == sorted(pairs)


def test_sixty_rows_that_all_compete_for_sixty_columns_are_all_paired() -> None:
    places = np.arange(60.0)
    costs = np.abs(places[:, None] - places[None, ::-1])
    assert assign(costs) == [(row, 59 - row) for row in range(60)]
