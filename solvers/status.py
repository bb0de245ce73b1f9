"""How a solve ends and what a row does: one enum each, and the plain integers that kernels use."""

from __future__ import annotations

from enum import IntEnum


class Status(IntEnum):
    """How a solve ended. The text of a status is its remedy."""

    SOLVED = 0
    ITERATION_LIMIT = 1
    NUMERICAL_FAILURE = 2
    BACKEND_FAILURE = 3
    INACCURATE = 4

    @property
    def remedy(self) -> str:
        """What to do about it, as a sentence."""
        return _REMEDIES[self]

    def __str__(self) -> str:
        return f"{self.name.lower().replace('_', ' ')}: {self.remedy}"


_REMEDIES = {
    Status.SOLVED: "nothing to do",
    Status.ITERATION_LIMIT: "raise max_iterations, or hand over the memory of the tick before; "
                            "x keeps the levels that were finished",
    Status.NUMERICAL_FAILURE: "x is zero; look for NaN or infinite entries in the rows, or for "
                              "entries so large that their squares overflow",
    Status.BACKEND_FAILURE: "x keeps the levels that were finished; try another backend, or scale "
                            "the rows to a similar norm",
    Status.INACCURATE: "an answer was found but not shown to be right: rows that are nearly "
                       "parallel, or of very different scale, leave a doubt; try another "
                       "resolver or backend",
}


class Code(IntEnum):
    """What a kernel returns: a `Status`, or what its caller must do. -(i + 1) refuses row i."""

    SOLVED = 0
    ITERATION_LIMIT = 1
    NUMERICAL_FAILURE = 2
    BACKEND_FAILURE = 3
    INACCURATE = 4
    UNPROVED = 7       # no set of active rows was shown to be right: another kernel goes on
    TOO_SMALL = 8      # the work space is, and nothing was done
    NO_LIMITS = 9      # all rows are equalities: the staircase solves them
    CONTRADICTION = 10  # two bounds of one unknown exclude each other


class Row(IntEnum):
    """What a row does: it acts at its upper or lower side, as an equality, or not at all."""

    FREE = 0
    UPPER = 1
    LOWER = -1
    EQUAL = 2


# numba stores no enum member in an array of floats, so kernels use these.
(SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, BACKEND_FAILURE, INACCURATE, UNPROVED, TOO_SMALL,
 NO_LIMITS, CONTRADICTION) = (int(code) for code in Code)
FREE, UPPER, LOWER, EQUAL = (int(row) for row in Row)
