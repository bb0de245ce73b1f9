"""Enums for the outcome of a solve and the state of a row, and their integers for kernels."""

from enum import IntEnum


class Status(IntEnum):
    """How a solve ended; the text of a status says what to do about it."""

    SOLVED = 0
    ITERATION_LIMIT = 1
    NUMERICAL_FAILURE = 2
    BACKEND_FAILURE = 3
    INACCURATE = 4

    @property
    def remedy(self) -> str:
        """What to do about it."""
        return _REMEDIES[self]

    def __str__(self) -> str:
        return f"{self.name.lower().replace('_', ' ')}: {self.remedy}"


_REMEDIES = {
    Status.SOLVED: "nothing to do",
    Status.ITERATION_LIMIT: "raise max_iterations, or pass the memory of the previous tick; "
                            "x is optimal for the finished levels",
    Status.NUMERICAL_FAILURE: "x is zero; check the rows for NaN or infinite entries, or for "
                              "entries whose squares overflow or underflow",
    Status.BACKEND_FAILURE: "x is optimal for the finished levels; try another backend, or "
                            "scale the rows to similar norms",
    Status.INACCURATE: "an answer was found but could not be verified: some rows are nearly "
                       "parallel or differ greatly in scale; try another resolver or backend",
}


class Row(IntEnum):
    """State of a row: active at its upper or lower side, an equality, or inactive."""

    FREE = 0
    UPPER = 1
    LOWER = -1
    EQUAL = 2


# numba cannot store enum members in an array of floats, so kernels use plain integers. A kernel
# returns a `Status`, a request to its caller, or -(i + 1), which rejects row i.
SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, BACKEND_FAILURE, INACCURATE = map(int, Status)
UNPROVED = 7        # no active set was verified: another kernel takes over
TOO_SMALL = 8       # the work space is too small; nothing was computed
CONTRADICTION = 10  # two bounds on one unknown contradict each other
FREE, UPPER, LOWER, EQUAL = map(int, Row)
