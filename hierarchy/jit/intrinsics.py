"""What kernels need and numba lacks: sums in lanes, and views of contiguous numbers.

numba keeps the order of a sum, so it adds one number after the other; `reshape` and `view` are
calls of their own.
"""

from collections.abc import Callable
from typing import Any

import numba
import numpy as np
from llvmlite import ir
from numba.core.errors import TypingError

from hierarchy.jit.inside import cgutils, intrinsic, types

_LANES = 8
_REST = (4, 2, 1)
_NUMBER, _INDEX = ir.DoubleType(), ir.IntType(32)


def _inner_product(context: Any, left: Any, right: Any) -> Any:
    """Return the inner product of two contiguous arrays, of which the first has the size.

    Lane j sums entries j, j + 8, ..; then halves of the lanes are added, and before each half the
    entries of the rest that fill it. Fewer than 8 are added one by one. This order is the same on
    every machine.
    """
    _require_contiguous(left, right)

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        arrays, size = _opened(context, builder, signature.args, arguments)
        sums = {width: cgutils.alloca_once_value(builder, _splat(builder, _NUMBER(0.0), width))
                for width in (_LANES, *_REST)}

        def add(at: Any, width: int) -> None:
            one, other = (_load(builder, array, at, width) for array in arrays)
            builder.store(_fused(builder, one, other, builder.load(sums[width])), sums[width])

        def halve(width: int) -> None:
            builder.store(_halved(builder, builder.load(sums[2 * width]), width), sums[width])

        _step_by_step(builder, size, add, halve)
        return builder.load(sums[1])

    return types.float64(left, right), write


def _add_multiple(context: Any, w: Any, factor: Any, v: Any) -> Any:
    """Add a multiple of v to w, both contiguous and not the same; v has the size."""
    _require_contiguous(w, v)

    def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds, (to, by, of) = signature.args, arguments
        (v, w), size = _opened(context, builder, (kinds[2], kinds[0]), (of, to))

        def add(at: Any, width: int) -> None:
            sums = _fused(builder, _splat(builder, by, width), _load(builder, v, at, width),
                          _load(builder, w, at, width))
            builder.store(sums, _place(builder, w, at, width), align=8)

        _step_by_step(builder, size, add, lambda width: None)
        return context.get_dummy_value()

    return types.void(w, types.float64, v), write


def _require_contiguous(*arrays: Any) -> None:
    if any(array.layout != "C" for array in arrays):
        raise TypingError(f"contiguous arrays are needed, not {arrays}")


def _opened(context: Any, builder: Any, kinds: Any, values: Any) -> tuple[list[Any], Any]:
    """Return arrays as structures, and the size of the first."""
    from numba.np import arrayobj

    arrays = [arrayobj.make_array(kind)(context, builder, value)
              for kind, value in zip(kinds, values, strict=True)]
    return arrays, cgutils.unpack_tuple(builder, arrays[0].shape, 1)[0]


def _step_by_step(builder: Any, size: Any, step: Callable[[Any, int], None],
                  halve: Callable[[int], None]) -> None:
    """Write the steps: of all lanes, then of halves for the rest; one by one for few entries."""
    few = builder.icmp_signed("<", size, size.type(_LANES))
    with builder.if_else(few) as (small, large):
        with small, cgutils.for_range_slice(builder, size.type(0), size, size.type(1)) as (at, _):
            step(at, 1)
        with large:
            end = builder.and_(size, size.type(-_LANES))
            with cgutils.for_range_slice(builder, size.type(0), end, size.type(_LANES)) as (at, _):
                step(at, _LANES)
            for width in _REST:
                halve(width)
                part = builder.and_(size, size.type(width))
                with builder.if_then(builder.icmp_signed("!=", part, size.type(0))):
                    step(end, width)
                end = builder.add(end, part)


def _place(builder: Any, array: Any, at: Any, width: int) -> Any:
    kind = _NUMBER if width == 1 else ir.VectorType(_NUMBER, width)
    return builder.bitcast(builder.gep(array.data, [at], inbounds=True), kind.as_pointer())


def _load(builder: Any, array: Any, at: Any, width: int) -> Any:
    return builder.load(_place(builder, array, at, width), align=8)


def _fused(builder: Any, left: Any, right: Any, third: Any) -> Any:
    """Return left times right plus the third, rounded once where the processor can."""
    kind = left.type
    name = f"llvm.fmuladd.{'f64' if kind == _NUMBER else f'v{kind.count}f64'}"
    function = cgutils.get_or_insert_function(
        builder.module, ir.FunctionType(kind, [kind] * 3), name)
    return builder.call(function, (left, right, third))


def _splat(builder: Any, value: Any, width: int) -> Any:
    """Return a number in all lanes."""
    if width == 1:
        return value
    kind = ir.VectorType(_NUMBER, width)
    one = builder.insert_element(ir.Constant(kind, ir.Undefined), value, _INDEX(0))
    lanes = ir.Constant(ir.VectorType(_INDEX, width), [0] * width)
    return builder.shuffle_vector(one, one, lanes)


def _halved(builder: Any, lanes: Any, width: int) -> Any:
    """Return one half of the lanes, `width`, added to the other."""
    if width == 1:
        return builder.fadd(*(builder.extract_element(lanes, _INDEX(at)) for at in (0, 1)))
    kind = ir.VectorType(_INDEX, width)
    halves = (ir.Constant(kind, list(range(at, at + width))) for at in (0, width))
    return builder.fadd(*(builder.shuffle_vector(lanes, lanes, half) for half in halves))


def _as_matrix(context: Any, numbers: Any, rows: Any, columns: Any) -> Any:
    """Return the view (rows, columns) of contiguous numbers, of which there must be so many."""
    return types.Array(numbers.dtype, 2, "C")(numbers, types.intp, types.intp), _view


def _as_integers(context: Any, numbers: Any) -> Any:
    """Return the view of contiguous numbers as int64."""
    return types.Array(types.int64, 1, "C")(numbers), _view


def _view(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Write a view of contiguous numbers, of the shape that follows them or their own."""
    from numba.np import arrayobj

    kind, (numbers, *shape) = signature.return_type, arguments
    flat = arrayobj.make_array(signature.args[0])(context, builder, numbers)
    view = arrayobj.make_array(kind)(context, builder)
    shape = shape or cgutils.unpack_tuple(builder, flat.shape, 1)
    strides = [*(builder.mul(size, flat.itemsize) for size in shape[1:]), flat.itemsize]
    arrayobj.populate_array(view, data=builder.bitcast(flat.data, view.data.type), shape=shape,
                            strides=strides, itemsize=flat.itemsize, meminfo=flat.meminfo,
                            parent=flat.parent)
    if context.enable_nrt:
        context.nrt.incref(builder, kind, view._getvalue())
    return view._getvalue()


_IN_NUMPY: tuple[Callable[..., Any], ...] = (
    lambda left, right: np.dot(left, right[:left.size]),
    lambda w, factor, v: np.add(w[:v.size], factor * v, out=w[:v.size]),
    lambda numbers, rows, columns: numbers.reshape((rows, columns)),
    lambda numbers: numbers.view(np.int64))
inner_product, add_multiple, as_matrix, as_integers = (
    _IN_NUMPY if numba.config.DISABLE_JIT else
    map(intrinsic, (_inner_product, _add_multiple, _as_matrix, _as_integers)))
