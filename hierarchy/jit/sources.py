"""What compiled code depends on: the text of the files behind a kernel, and the types it takes.

What a file imports counts for all its kernels: a helper further down may use it.
"""

import hashlib
import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hierarchy.jit.inside import BaseTuple, types
from hierarchy.jit.linking import found

Kernel = Callable[..., Any]  # without annotations: its types are those of the first call
_OWN = tuple(str(Path(__file__).with_name(f"{name}.py")) for name in (
    "compiling", "intrinsics"))  # these write code of their own
_KIND = re.compile(r"(readonly )?array\((\w+), (\d)d, (\w)\)|([\w.]+)(\()?|\)")


def behind(functions: Iterable[Kernel]) -> set[str]:
    """Return digests of files of functions and all kernels that they know, numbers in these too.

    Those are numbers, arrays and the like that a kernel names, also of a function that made it.
    """
    texts, ahead, seen = set[str](), list(functions), set[Any]()
    while ahead:
        function = ahead.pop()
        known, code = function.__globals__, function.__code__
        if function not in seen:
            seen.add(function)
            own = [cell.cell_contents for cell in function.__closure__ or ()]
            used = dict(zip(code.co_freevars, own, strict=True)) | _named(code.co_names, known)
            ahead += [value.py_func for value in used.values() if hasattr(value, "py_func")]
            numbers = {name: value.tolist() if hasattr(value, "tolist") else value for name, value
                       in used.items() if not callable(value) and type(value) is not ModuleType}
            texts.add(f"{function.__qualname__}: {numbers!r}")
        texts.add(getattr(function, "digest", "") or digest_of(function))
        if id(known) in seen:
            continue
        seen.add(id(known))
        for name, value in known.items():
            if hasattr(value, "py_func"):
                ahead.append(value.py_func)
            elif name.isupper() and isinstance(value, (int, float, np.integer)):
                texts.add(f"{name} = {value!r}")
    return texts


def _named(names: tuple[str, ...], known: dict[str, Any]) -> dict[str, Any]:
    """Return what code with these names finds in its module, and in modules that it names."""
    used, scopes = dict[str, Any](), [known]
    for scope in scopes:
        used |= {f"{scope.get('__name__')}.{name}": scope[name] for name in names if name in scope}
        scopes += [vars(value) for value in used.values() if type(value) is ModuleType
                   and all(vars(value) is not one for one in scopes)]
    return used


def source_digest(*functions: Any) -> str:
    """Return a digest of all sources and constants behind functions, the same on every machine.

    It is "" if a file is not to be found: that of a cell of a notebook, or in an archive.
    """
    try:
        content = behind(getattr(one, "py_func", one) for one in functions)
        content |= set(map(_digest_of, _OWN))
    except OSError:
        return ""
    return hashlib.sha256("\n".join(sorted(content)).encode()).hexdigest()


def digest_of(function: Kernel) -> str:
    """Return the digest of the file of a function as it is now; raises OSError if it is missing."""
    file = function.__globals__.get("__file__", function.__code__.co_filename)  # if bundled
    status = Path(file).stat()
    return _digest_of(file, status.st_mtime_ns, status.st_size)


@cache
def _digest_of(file: str, *_: int) -> str:
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def described(kinds: tuple[Any, ...]) -> str:
    """Return types of arguments as text; classes of named tuples with their modules."""
    classes = [getattr(kind, "instance_class", tuple) for kind in kinds]
    return ", ".join(f"{of.__module__}.{of.__qualname__}({described(tuple(kind))})"
                     if isinstance(kind, BaseTuple) else str(kind)
                     for kind, of in zip(kinds, classes, strict=True))


def kinds_in(text: str) -> tuple[Any, ...]:
    """Return the types of arguments that `described` wrote; raises ValueError for others."""
    stack: list[list[Any]] = [[]]
    for fixed, of, dimension, layout, name, opened in _KIND.findall(text):
        if of:
            kind = types.Array(getattr(types, of), int(dimension), layout, readonly=bool(fixed))
        elif opened:
            stack.append([name])
            continue
        elif name:
            kind = getattr(types, name)
        else:
            named, *parts = stack.pop()
            kind = BaseTuple.from_types(parts, found(named))
        stack[-1].append(kind)
    if described(tuple(stack[0])) != text:
        raise ValueError(f"no types of arguments: {text}")
    return tuple(stack[0])
