"""The column `loop` of a table: rows of one loop in the order in which their loads were applied."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from coupling.files.measured_table import MeasuredTable

LOOP = "loop"


def loops_of(table: MeasuredTable, kept: Sequence[str]) -> np.ndarray | None:
    """Return the number of each row's loop, (k,); None without the column.

    Args:
        table: The table.
        kept: Columns that stay as they are within a loop: drives, and where the load acts.

    Raises:
        IdentifyError: With line, if a number is none, or rows are no loops.
    """
    if not table.has((LOOP,)):
        return None
    numbers = table.of((LOOP,))[:, 0]
    uneven = np.flatnonzero(numbers != np.round(numbers))
    if len(uneven):
        raise table.row_error(LOOP, int(uneven[0]), "the whole number of a loop")
    starts = np.flatnonzero(np.append(True, np.diff(numbers) != 0.0))
    states = table.of(kept)
    for start, end in zip(starts, [*starts[1:], len(numbers)], strict=True):
        if numbers[start] in numbers[:start]:
            raise table.row_error(
                LOOP, int(start), "the rows of a loop one after the other, as they were loaded"
            )
        if end - start < 2:
            raise table.row_error(
                LOOP, int(start), "two rows or more of each loop, the way and back"
            )
        moved = np.argwhere(np.any(states[start:end] != states[start], axis=0))
        if len(moved):
            name, column = kept[int(moved[0, 0])], int(moved[0, 0])
            row = int(start + np.argmax(states[start:end, column] != states[start, column]))
            raise table.row_error(
                name, row, f"as in the first row of its loop, {states[start, column]:.6g}"
            )
    if len(starts) < 2:
        raise table.row_error(LOOP, 0, "two loops or more, as each is predicted by the others")
    return numbers.astype(int)
