"""Fields of dataclasses: what their types ask of values, and those computed from others.

`Annotated[type, check]` asks: check(what, value) raises a HierarchyError for a wrong value. With
`Annotated[type, check, unit]` the unit is named too.
"""

import builtins
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import Field, fields, is_dataclass
from functools import partial
from inspect import get_annotations
from types import NoneType, SimpleNamespace
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

from hierarchy.errors import check_choice, finite_numbers, number, positive, real, text, whole

Check = Callable[[str, Any], Any]
Positive = Annotated[float, positive]
NotNegative = Annotated[float, partial(number, least=0.0)]
Vector3 = Annotated[Sequence[float], partial(finite_numbers, size=3)]
PLAIN: dict[Any, Check] = {float: real, int: whole, str: text}
_Asked = tuple[str, str, bool, Check, bool]  # name, also with unit, may be None, check, a number
_known: dict[type, list[_Asked]] = {}  # what is asked of the fields of each class


def set_frozen(record: object, **values: object) -> None:
    """Set fields of a frozen dataclass; only for its own `__post_init__`."""
    put = object.__setattr__  # looked up once: a hierarchy is made in each tick of an adapter
    for name, value in values.items():
        put(record, name, value)


def check_fields(record: object, what: str, plain: Mapping[Any, Check] = PLAIN,
                 free: Collection[str] = ()) -> None:
    """Raise a HierarchyError for a field that is not what its type asks for; make numbers floats.

    plain : checks of types that are not Annotated. free : names of fields that need none of these.
    """
    kind = type(record)
    if kind not in _known:
        _known[kind] = list(_asked(kind, plain, free))
    for name, said, optional, check, is_number in _known[kind]:
        value = getattr(record, name, None)
        if value is not None or not optional:
            found = check(f"{what}: {said}", value)
            if is_number:
                object.__setattr__(record, name, found)


def _asked(kind: Any, plain: Mapping[Any, Check], free: Collection[str]) -> Iterator[_Asked]:
    """Yield what is asked of each field that can be given and of which something is asked."""
    names = {one.__name__: one for one in plain}
    for field in (field for field in fields(kind) if field.init):
        hint = _hint(kind, field, names)
        others = [part for part in get_args(hint) if part is not NoneType]
        optional = NoneType in get_args(hint) and len(others) == 1
        hint = others[0] if optional else hint
        check, *unit = getattr(hint, "__metadata__", (None,))
        own = hint.__origin__ if hasattr(hint, "__metadata__") else hint
        if not callable(check) or isinstance(check, type):  # what other packages annotate with
            check, unit = None if field.name in free else plain.get(own), []
        if get_origin(own) is Literal:
            check = partial(check_choice, known=get_args(own))
        if check is not None:
            said = "".join((field.name, *(f" [{one}]" for one in unit)))
            yield field.name, said, optional, check, own in (float, int)


def _hint(kind: type, field: Field[Any], names: Mapping[str, Any]) -> Any:
    """Return the type of a field, None if that is unknown; `names` may be so where it is made."""
    with suppress(Exception):  # a user may annotate with anything
        owner = next(one for one in kind.__mro__ if field.name in get_annotations(one))
        scope = {**names, **vars(sys.modules.get(owner.__module__, builtins))}
        one = SimpleNamespace(__annotations__={field.name: field.type})
        return get_type_hints(one, scope, include_extras=True)[field.name]
    return None


def equal(one: Any, other: Any) -> bool:
    """Whether two values are the same; of a dataclass, its fields, and of an array, its numbers.

    It can be the `__eq__` of a class, in place of one that raises where a field is an array.
    """
    if one is other or isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return one is other or np.array_equal(one, other)
    if is_dataclass(one) and type(one) is type(other):
        return all(equal(getattr(one, field.name), getattr(other, field.name))
                   for field in fields(one) if field.compare)
    if isinstance(one, list | tuple) and type(one) is type(other):
        return len(one) == len(other) and all(map(equal, one, other))
    return one.__class__.__eq__ is not equal and bool(one == other)
