"""Views of contiguous numbers in kernels, where `reshape` and `view` are calls of their own."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from hierarchy.jit.inside import cgutils, intrinsic, types


def _as_matrix(context: Any, numbers: Any, rows: Any, columns: Any) -> Any:
    """Return the view (rows, columns) of contiguous numbers, of which there must be so many.

    In kernels, where `reshape` costs a call of its own.
    """
    from numba.np import arrayobj

    kind = types.Array(numbers.dtype, 2, "C")

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        flat = arrayobj.make_array(numbers)(context, builder, arguments[0])
        view = arrayobj.make_array(kind)(context, builder)
        width = builder.mul(arguments[2], flat.itemsize)
        arrayobj.populate_array(view, data=flat.data, shape=arguments[1:],
                                strides=[width, flat.itemsize], itemsize=flat.itemsize,
                                meminfo=flat.meminfo, parent=flat.parent)
        if context.enable_nrt:
            context.nrt.incref(builder, kind, view._getvalue())
        return view._getvalue()

    return kind(numbers, types.intp, types.intp), write


def _as_integers(context: Any, numbers: Any) -> Any:
    """Return the view of contiguous numbers as int64; `view` is a kernel of its own to compile."""
    from numba.np import arrayobj

    kind = types.Array(types.int64, 1, "C")

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        flat = arrayobj.make_array(numbers)(context, builder, arguments[0])
        view = arrayobj.make_array(kind)(context, builder)
        data = builder.bitcast(flat.data, view.data.type)
        shape, strides = (cgutils.unpack_tuple(builder, part, 1)
                          for part in (flat.shape, flat.strides))
        arrayobj.populate_array(view, data=data, shape=shape, strides=strides,
                                itemsize=flat.itemsize, meminfo=flat.meminfo, parent=flat.parent)
        if context.enable_nrt:
            context.nrt.incref(builder, kind, view._getvalue())
        return view._getvalue()

    return kind(numbers), write


if numba.config.DISABLE_JIT:
    def as_matrix(numbers: Any, rows: int, columns: int) -> Any:
        """See `_as_matrix`."""
        return numbers.reshape((rows, columns))

    def as_integers(numbers: Any) -> Any:
        """See `_as_integers`."""
        return numbers.view(np.int64)
else:
    as_matrix, as_integers = intrinsic(_as_matrix), intrinsic(_as_integers)
