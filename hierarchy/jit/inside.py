"""What this package takes from inside numba and llvmlite, beyond what their documents promise."""

import numba

_KNOWN = "0.62 to 0.68"
try:
    import llvmlite.binding as llvm
    from numba._dynfunc import make_function
    from numba.core import cgutils, compiler, event, registry, types
    from numba.core.base import _load_global_helpers as load_helpers
    from numba.core.caching import NullCache
    from numba.core.codegen import JITCodeLibrary as CodeLibrary
    from numba.core.codegen import JITCPUCodegen as Codegen
    from numba.core.compiler import CompileResult
    from numba.core.compiler_lock import global_compiler_lock
    from numba.core.cpu import CPUContext
    from numba.core.environment import Environment
    from numba.core.errors import NumbaError
    from numba.core.registry import CPUDispatcher
    from numba.core.runtime import rtsys
    from numba.core.runtime._nrt_python import c_helpers as nrt_helpers
    from numba.core.runtime.nrtdynmod import compile_nrt_functions
    from numba.core.serialize import dumps
    from numba.core.types.containers import BaseTuple
    from numba.extending import intrinsic

    _ = (CPUDispatcher._insert, CPUDispatcher._compile_for_args, CPUDispatcher.add_overload,
         CompileResult._reduce, CompileResult._rebuild, CPUContext.get_executable,
         Codegen._library_class, Codegen._module_pass_manager, Codegen.set_env,
         CodeLibrary.finalize, CodeLibrary._get_module_for_linking)
except (ImportError, AttributeError) as error:
    raise ImportError(f"task-hierarchy works inside numba {_KNOWN}, not {numba.__version__}: "
                      f"{error}") from error

__all__ = ["BaseTuple", "CPUContext", "CPUDispatcher", "CodeLibrary", "Codegen",
           "CompileResult", "Environment", "NullCache", "NumbaError", "cgutils",
           "compile_nrt_functions", "compiler", "dumps", "event", "global_compiler_lock",
           "intrinsic", "llvm", "load_helpers", "make_function", "nrt_helpers", "registry", "rtsys",
           "types"]
