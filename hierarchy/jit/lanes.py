"""Sums that run in lanes: numba keeps the order of a sum, so it adds one number after the other."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core.errors import TypingError

from hierarchy.jit.inside import cgutils, intrinsic, types

_LANES = 8


def _inner_product(context: Any, left: Any, right: Any) -> Any:
    """Return the inner product of two contiguous arrays, of which the first has the size.

    Lane j sums entries j, j + 8, ..; then halves of the lanes are added, and what is left over one
    by one. This order is the same on every machine.
    """
    from numba.np import arrayobj

    if left.layout != "C" or right.layout != "C":
        raise TypingError(f"inner_product takes contiguous arrays, not {left} and {right}")

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        arrays = [arrayobj.make_array(kind)(context, builder, value)
                  for kind, value in zip(signature.args, arguments, strict=True)]
        size = cgutils.unpack_tuple(builder, arrays[0].shape, 1)[0]
        whole, number = builder.and_(size, size.type(-_LANES)), ir.DoubleType()
        total = cgutils.alloca_once_value(builder, number(0.0))
        with builder.if_then(builder.icmp_signed(">", whole, size.type(0))):
            lanes = _sum(builder, arrays, (size.type(0), whole, _LANES),
                         ir.Constant(ir.VectorType(number, _LANES), [0.0] * _LANES))
            builder.store(_added(builder, lanes), total)
        return _sum(builder, arrays, (whole, size, 1), builder.load(total))

    return types.float64(left, right), write


def _sum(builder: Any, arrays: Any, span: tuple[Any, Any, int], begin: Any) -> Any:
    """Add the products of entries of a span, so many at a time, to a number or a vector."""
    first, last, step = span
    total = cgutils.alloca_once_value(builder, begin)
    with cgutils.for_range_slice(builder, first, last, first.type(step)) as (index, _):
        entries = [builder.load(builder.bitcast(builder.gep(array.data, [index], inbounds=True),
                                                begin.type.as_pointer()), align=8)
                   for array in arrays]
        builder.store(builder.fadd(builder.load(total), builder.fmul(*entries)), total)
    return builder.load(total)


def _added(builder: Any, lanes: Any) -> Any:
    """Return the sum of the lanes: one half to the other, until one is left."""
    width = _LANES
    while width > 1:
        width //= 2
        kind = ir.VectorType(ir.IntType(32), width)
        halves = (ir.Constant(kind, list(range(at, at + width))) for at in (0, width))
        lanes = builder.fadd(*(builder.shuffle_vector(lanes, lanes, half) for half in halves))
    return builder.extract_element(lanes, ir.IntType(32)(0))


if numba.config.DISABLE_JIT:
    def inner_product(left: Any, right: Any) -> Any:
        """See `_inner_product`."""
        return np.dot(left, right[:left.size])
else:
    inner_product = intrinsic(_inner_product)
