"""How kernels are linked: each is optimised once, with those inlined in it; callers name the rest.

numba links the code of all callees into a caller and optimises the whole again, at every level.
"""

import gc
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any, NamedTuple

from hierarchy.jit.inside import Codegen, CodeLibrary, CPUContext, llvm, registry


class Machine(NamedTuple):
    """What code is compiled for, in LLVM's words; empty features: those of the processor."""

    triple: str
    processor: str
    features: str


Call = tuple[str, tuple[Any, ...]]  # the name of a kernel with its module, types of arguments

_SHARED = {llvm.Linkage.external, llvm.Linkage.linkonce_odr, llvm.Linkage.common}


class Library(CodeLibrary):  # type: ignore[misc]
    """Compiled code that is linked into its callers, or named there if it is that of a kernel.

    kernel : what `found` finds it by; None if it is linked into callers.
    calls : the libraries that the code names.
    runs : whether there is machine code of it, not only LLVM code for whom it is linked into.
    """

    naming = False  # while a kernel compiles; numba's own cache knows no names
    linked_only: Any = None  # the function that compiles now, if it does not run
    running = True  # whether others do

    def __init__(self, *about: Any) -> None:
        super().__init__(*about)
        self.kernel: Call | None = None
        self.calls: dict[Any, None] = {}
        self.runs = Library.running

    def add_linking_library(self, library: Any) -> None:
        """Link a library when this one is finished, or note that its names are needed."""
        further = getattr(library, "calls", {})
        if not Library.naming:
            for one in (library, *(one for one in _all_behind(further) if one.kernel)):
                super().add_linking_library(one)
            return
        self.calls.update(further)
        if getattr(library, "kernel", None) is None:
            super().add_linking_library(library)
        else:
            self.calls[library] = None

    def finalize(self) -> None:
        """Optimise the code with all that is linked in and add it to the process, if it runs."""
        if self.runs:
            super().finalize()
            return
        for library in dict.fromkeys(self._linking_libraries):
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalized = True


def _executable(context: Any, library: Any, about: Any, environment: Any) -> Any:
    """Return what Python calls; of what does not run any builtin, unlike all others."""
    library.environment = about.env_name, environment
    only = Library.linked_only
    library.runs = Library.running and (only is None or (about.modname, about.qualname) != (
        only.__module__, only.__qualname__))
    if not library.runs:
        return [].append
    made = _made(context, library, about, environment)
    for one in _all_behind([library]):
        if not getattr(one, "runs", True):  # numba's own, made before this was imported, do
            library.codegen.set_env(*one.environment)  # for what it prints
    return made


Codegen._library_class = Library
_made, CPUContext.get_executable = CPUContext.get_executable, _executable


@contextmanager
def naming(linked_only: Any = None) -> Iterator[None]:
    """Let code that is compiled now name the kernels that it calls.

    linked_only : the function that is compiled, if its code is only linked into callers.
    """
    before, collecting = (Library.naming, Library.linked_only), gc.isenabled()
    Library.naming, Library.linked_only = True, linked_only
    gc.disable()  # looking through what numba keeps takes a seventh of the time
    try:
        yield
    finally:
        Library.naming, Library.linked_only = before
        if collecting:
            gc.enable()


def name_of(kernel: Any) -> str:
    """Return the name of a kernel with its module, "" if it is not to be found there."""
    function = kernel.py_func
    name = f"{function.__module__}.{function.__qualname__}"
    try:
        return name if found(name) is kernel else ""
    except (ImportError, AttributeError):
        return ""


def found(name: str) -> Any:
    """Return the kernel with this name."""
    module, _, short = name.rpartition(".")
    return getattr(import_module(module), short)


def machine() -> Machine:
    """Return what this process compiles for: its own processor, or NUMBA_CPU_NAME."""
    return Machine(*registry.cpu_target.target_context.codegen().magic_tuple())


def object_code(module: Any, machine: Machine) -> bytes:
    """Return the object file of a module for a machine; it can be loaded anywhere in memory.

    Raises
    ------
    RuntimeError : this llvmlite makes no code for the triple.
    """
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple(machine.triple).create_target_machine(
        cpu=machine.processor, features=machine.features, opt=3, reloc="pic", codemodel="default")
    module.triple, module.data_layout = machine.triple, str(target.target_data)
    return bytes(target.emit_object(module))


def linked(libraries: Iterable[Any], visible: set[str]) -> Any:
    """Return one optimised module of these and all behind them; only these names are visible."""
    whole, behind = llvm.parse_assembly(""), _all_behind(libraries)
    for is_optimised in (False, True):
        for library in behind:
            if (library._finalized and getattr(library, "runs", True)) is is_optimised:
                module = library._get_module_for_linking().clone()
                for one in (*module.functions, *module.global_variables):
                    if not one.is_declaration and one.linkage in _SHARED:
                        one.linkage = "weak_odr"  # or what nothing refers to yet is dropped
                whole.link_in(module)
        hide(whole, visible)
        if not is_optimised:
            manager, builder = _passes()
            manager.run(whole, builder)
    return whole


def merged(module: Any, name: str) -> Any:
    """Return a module of one function: that of this name with all that it calls inside."""
    # As text, since llvmlite below 0.50 puts the attribute on what the functions return.
    inlined = re.sub(rf'^(define (?!.*@"?{name}"?\().*){{$', r"\1alwaysinline {", str(module),
                     flags=re.MULTILINE)
    module = llvm.parse_assembly(inlined)
    manager, builder = _passes()
    manager.run(module, builder)
    hide(module, {name})
    return module


def hide(module: Any, visible: set[str]) -> None:
    """Keep the functions of these names visible in a module, and drop what none of them uses."""
    for one in (*module.functions, *module.global_variables):
        if not one.is_declaration:
            one.linkage = "external" if one.name in visible else "internal"
    manager = llvm.create_new_module_pass_manager()
    manager.add_global_dead_code_eliminate_pass()
    manager.add_strip_dead_prototype_pass()
    manager.run(module, _passes()[1])


def stripped(module: Any) -> Any:
    """Return a module without names but those of functions: they are half of its size."""
    names, manager = [one.name for one in module.functions], llvm.create_new_module_pass_manager()
    manager.add_strip_symbols_pass()
    manager.run(module, _passes()[1])
    for one, name in zip(module.functions, names, strict=True):
        one.name = name
    return module


def _passes() -> Any:
    """Return numba's passes over a module, and what runs them."""
    return registry.cpu_target.target_context.codegen()._module_pass_manager()


def _all_behind(libraries: Iterable[Any]) -> list[Any]:
    """Return libraries and all that they link or name."""
    seen: dict[Any, None] = {}
    waiting = list(libraries)
    while waiting:
        library = waiting.pop()
        if library not in seen:
            seen[library] = None
            waiting += [*library._linking_libraries, *getattr(library, "calls", ())]
    return list(seen)
