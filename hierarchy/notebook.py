"""Tables for notebooks: short, with every value escaped.

String building is enough here: the core does not import a template engine.
"""

from collections.abc import Collection, Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

_MOST = 30      # rows of a table that are shown
_ENTRIES = 8    # entries of an array that are shown


def html_table(caption: str, head: Sequence[object], rows: Sequence[Sequence[object]],
               best: Collection[tuple[int, int]] = ()) -> str:
    """Return an HTML table with at most 30 rows; cells at the (row, column) of `best` are bold."""
    lines = [[f"<th>{escape(str(name))}</th>" for name in head]] if head else []
    for i, row in enumerate(rows[:_MOST]):
        lines.append([f"<td><b>{text}</b></td>" if (i, j) in best else f"<td>{text}</td>"
                      for j, text in enumerate(escape(str(value)) for value in row)])
    if (left := len(rows) - _MOST) > 0:
        lines.append([f'<td colspan="{max(1, len(head))}">... and {left} more</td>'])
    shown = "".join(f"<tr>{''.join(cells)}</tr>" for cells in lines)
    return f"<table><caption>{escape(caption)}</caption>{shown}</table>"


def numbers(values: NDArray[np.float64]) -> str:
    """Return an array in one line with four digits, without the middle where it is long."""
    return np.array2string(np.asarray(values), precision=4, threshold=_ENTRIES, edgeitems=3,
                           suppress_small=True, max_line_width=1000)
