"""A kernel together with the arrays that it is called with again and again."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np

from hierarchy.jit.sources import Kernel


def bind(kernel: Kernel, *arguments: Any, then: tuple[Any, ...] = ()) -> Callable[..., Any]:
    """Return `kernel` bound to its first arguments; a call gives the rest: numbers, tuples of them.

    A call of a kernel looks at the type of every argument, each time (20 arrays: 0.4 us). Here that
    is done once, and a call costs a third. `then` has an example of each argument of a call; where
    it has a number, a call may give any that Python can convert.
    """
    dispatcher: Any = kernel
    if not hasattr(dispatcher, "overloads"):  # NUMBA_DISABLE_JIT
        return partial(kernel, *arguments)
    types = tuple(_type_of(value) for value in (*arguments, *then))
    entry = dispatcher.entry(types)
    return partial(entry, *arguments) if arguments else entry


_TYPES: dict[tuple[Any, ...], Any] = {}


def _type_of(value: Any) -> Any:
    """Return numba's type of a value; types of arrays are cached, since finding one takes 4 us."""
    if not isinstance(value, np.ndarray):
        return numba.typeof(value)
    kind = value.dtype, value.ndim, value.flags.num
    if kind not in _TYPES:
        _TYPES[kind] = numba.typeof(value)
    return _TYPES[kind]
