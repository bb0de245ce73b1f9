"""Compiled functions for programs without Python: a C signature, and LLVM code to make objects of.

numba's own `cfunc` reports errors through the interpreter and so refers to it. Here a function gets
a plain C entry that returns its error code instead, and nothing refers to Python.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, final

import numba
from llvmlite import ir
from numba.np import arrayobj

from hierarchy.jit.inside import (
    cgutils,
    compiler,
    global_compiler_lock,
    intrinsic,
    llvm,
    registry,
    types,
)
from hierarchy.jit.linking import linked, naming
from hierarchy.jit.sources import Kernel

INTEGER, STATUS = types.int64, types.int32  # of arguments and results; a pointer is an INTEGER too

_OPTIONS = {"nopython": True, "error_model": "numpy", "_nrt": False,
            "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


@final
@dataclass(frozen=True)
class Machine:
    """What code is compiled for, in LLVM's words; empty features: those of the processor."""

    triple: str
    processor: str
    features: str


@final
@dataclass(frozen=True)
class Entry:
    """A function without arrays among its arguments, to be called from C.

    function : takes `arguments` numbers of type INTEGER and returns one of type `result`.
    failed : what the entry returns if the function ends in an error of Python.
    """

    function: Kernel
    arguments: int
    result: Any
    failed: int


def machine() -> Machine:
    """Return what this process compiles for: its own processor, or NUMBA_CPU_NAME."""
    return Machine(*registry.cpu_target.target_context.codegen().magic_tuple())


def compiles() -> bool:
    """Whether kernels are compiled at all; not with NUMBA_DISABLE_JIT."""
    return not numba.config.DISABLE_JIT


@global_compiler_lock  # type: ignore[untyped-decorator]
def lowered(entries: Mapping[str, Entry]) -> Any:
    """Return one optimised LLVM module in which only the entries are visible, under their names."""
    library = registry.cpu_target.target_context.codegen().create_library("entries")
    library.runs = False  # here
    with naming():
        for name, entry in entries.items():
            _add(library, name, entry)
    return linked([library], set(entries))


def object_code(module: Any, triple: str, processor: str, features: str) -> bytes:
    """Return the object file of a module, with code that can be loaded anywhere in memory.

    Raises
    ------
    RuntimeError : this llvmlite makes no code for the triple.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=3, reloc="pic", codemodel="default")
    module.triple, module.data_layout = triple, str(target.target_data)
    return bytes(target.emit_object(module))


def _add(library: Any, name: str, entry: Entry) -> None:
    """Add a function with its C entry to a library of numba's."""
    target, flags = registry.cpu_target, compiler.Flags()
    target.options.parse_as_flags(flags, _OPTIONS)
    flags.no_compile = True  # not yet: the entry is still to come
    compiled = compiler.compile_extra(
        target.typing_context, target.target_context, entry.function,
        args=(INTEGER,) * entry.arguments, return_type=entry.result, flags=flags, locals={},
        library=library)
    library.add_ir_module(_c_entry(name, compiled.fndesc, entry.failed))


def _c_entry(name: str, about: Any, failed: int) -> Any:
    """Return a module with a function of C that calls a compiled one."""
    context = registry.cpu_target.target_context
    convention, module = context.call_conv, context.codegen()._create_empty_module(name)
    inner = ir.Function(module, convention.get_function_type(about.restype, about.argtypes),
                        about.llvm_func_name)
    result = context.get_value_type(about.restype)
    outer = ir.Function(module, ir.FunctionType(
        result, [context.get_value_type(kind) for kind in about.argtypes]), name)
    builder = ir.IRBuilder(outer.append_basic_block())
    status, value = convention.call_function(builder, inner, about.restype, about.argtypes,
                                             outer.args)
    with cgutils.if_unlikely(builder, status.is_error):
        builder.ret(ir.Constant(result, failed))
    builder.ret(value)
    return module


def _view(dtype: Any) -> Any:
    """Return an intrinsic: the array of `size` numbers at an address."""
    kind = types.Array(dtype, 1, "C")

    def view(context: Any, address: Any, size: Any) -> Any:
        def write(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = arrayobj.make_array(kind)(context, builder)
            width = context.get_constant(types.intp, 8)
            arrayobj.populate_array(
                array, data=builder.inttoptr(arguments[0], array.data.type), shape=[arguments[1]],
                strides=[width], itemsize=width, meminfo=None)
            return array._getvalue()

        return kind(types.int64, types.int64), write

    return intrinsic(view)


numbers_at, integers_at = _view(types.float64), _view(types.int64)
