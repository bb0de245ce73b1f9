"""Object files: of functions for programs without Python, and of kernels for `ahead` to load.

numba's own `cfunc` reports errors through the interpreter and so refers to it. Here a function gets
a plain C entry that returns its error code instead, and nothing refers to Python. A kernel is
compiled as it would be when called, for a processor that numba is told by its environment when this
process starts; only the machine code is made once, of all of them together.
"""

import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numba
import numpy as np
from llvmlite import ir
from numba.np import arrayobj

from hierarchy.jit.caching import PROCESSOR, Code, Part, write_part
from hierarchy.jit.compiling import Cached
from hierarchy.jit.inside import (
    cgutils,
    compile_nrt_functions,
    compiler,
    global_compiler_lock,
    llvm,
    registry,
    rtsys,
    types,
)
from hierarchy.jit.linking import (
    Library,
    found,
    hide,
    linked,
    machine,
    naming,
    object_code,
    stripped,
)
from hierarchy.jit.saying import say
from hierarchy.jit.sources import Kernel, kinds_in, source_digest

INTEGER, STATUS = types.int64, types.int32  # of arguments and results; a pointer is an INTEGER too

_OPTIONS = {"nopython": True, "error_model": "numpy", "_nrt": False,
            "no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class Entry(NamedTuple):
    """A function without arrays among its arguments, to be called from C.

    function : takes numbers of type INTEGER and returns one of type `result`.
    failed : what the entry returns if the function ends in an error of Python.
    """

    function: Kernel
    result: Any
    failed: int


@global_compiler_lock  # type: ignore[untyped-decorator]
def lowered(entries: Mapping[str, Entry]) -> Any:
    """Return one optimised LLVM module in which only the entries are visible, under their names."""
    return linked([_library(entries)], set(entries))


def stored(part: Part | None, entries: Mapping[str, Entry]) -> Any:
    """Return the module of these and other entries in a part; None if it does not suit."""
    with suppress(RuntimeError):  # damaged, or of a newer LLVM
        if part and part.functions == _digest(entries) != "":
            return llvm.parse_bitcode(part.code("llvm"))
    return None


def _digest(entries: Mapping[str, Entry]) -> str:
    return source_digest(*(entry.function for entry in entries.values()))


def _library(entries: Mapping[str, Entry]) -> Any:
    """Return a library of numba's with these entries, for which there is no machine code here."""
    target = registry.cpu_target
    library = target.target_context.codegen().create_library("entries")
    library.runs = False
    with naming():
        for name, entry in entries.items():
            flags = compiler.Flags()
            target.options.parse_as_flags(flags, _OPTIONS)
            flags.no_compile = True  # not yet: the entry is still to come
            compiled = compiler.compile_extra(
                target.typing_context, target.target_context, entry.function,
                args=(INTEGER,) * entry.function.__code__.co_argcount,
                return_type=entry.result, flags=flags, locals={}, library=library)
            library.add_ir_module(_c_entry(name, compiled.fndesc, entry.failed))
    return library


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

    return numba.extending.intrinsic(view)


numbers_at, integers_at = _view(types.float64), _view(types.int64)


ENVIRONMENT = {  # of a process that builds
    "NUMBA_CPU_NAME": PROCESSOR if platform.machine() in ("x86_64", "AMD64") else "generic",
    "NUMBA_CPU_FEATURES": "", "NUMBA_DISABLE_INTEL_SVML": "1"}


@global_compiler_lock  # type: ignore[untyped-decorator]
def build(name: str, calls: Sequence[str], functions: Mapping[str, Entry]) -> int:
    """Write a part with these calls and functions; return the size of its machine code [B].

    calls : each `name(types)`, as `described` writes types. functions : of C, for `stored`.
    """
    Library.running = Cached.kept = False
    # Machine code was made of that of this process, which wrote instructions of x86-64 into it.
    rtsys._library = compile_nrt_functions(registry.cpu_target.target_context)
    entries, libraries = _compiled(name, calls)
    if functions:
        libraries.append(_library(functions))
    names = {name for entry in entries.values() for name in (entry.wrapper, entry.environment)}
    whole = linked(libraries, {*names, *functions})
    code = stripped(whole.clone()).as_bitcode()
    hide(whole, names)
    machine_code = object_code(whole, machine())
    externals = sorted(one.name for one in (*whole.functions, *whole.global_variables)
                       if one.is_declaration and not one.name.startswith("llvm."))
    write_part(name, (calls, _digest(functions), entries, externals),
               machine=machine_code, llvm=code)
    return len(machine_code)


def _compiled(part: str, calls: Sequence[str]) -> tuple[dict[str, Code], list[Any]]:
    """Return how to find each call in an object file, and numba's libraries with their code.

    A call whose environment holds other than types of numbers is left out.
    """
    entries: dict[str, Code] = {}
    libraries: list[Any] = []
    for count, call in enumerate(calls):
        if count % 20 == 0:
            say(f"{part}: {count} of {len(calls)}")
        name, _, text = call.removesuffix(")").partition("(")
        kernel, kinds = found(name), kinds_in(text)
        kernel.compile(kinds)
        made = kernel.overloads[kinds]
        constants = made.environment.consts
        if all(isinstance(one, np.dtype) and one.fields is None for one in constants):
            libraries.append(made.library)
            entries[call] = Code(source_digest(kernel), made.fndesc.llvm_cpython_wrapper_name,
                                 made.fndesc.env_name, tuple(one.str for one in constants))
    return entries, libraries


def is_current(name: str, calls: Sequence[str], functions: Mapping[str, Entry]) -> bool:
    """Whether a part was made of this list of calls and these functions as their sources are."""
    part = Part.read(name)
    return part is not None and part.calls == calls and bool(stored(part, functions)) and all(
        entry.digest == source_digest(found(call.partition("(")[0]))
        for call, entry in part.entries.items())
