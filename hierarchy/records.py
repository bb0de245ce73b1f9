"""Fields of dataclasses: what their types ask of values, and those computed from others.

`Annotated[type, check]` asks: check(what, value) raises a HierarchyError for a wrong value. With
`Annotated[type, check, unit]` the unit is named too.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from functools import cache, partial
from types import NoneType
from typing import Annotated, Any, Literal, get_args, get_origin, get_type_hints

from hierarchy.errors import check_choice, finite_numbers, number, positive, real, whole

Check = Callable[[str, Any], Any]
Positive = Annotated[float, positive]
NotNegative = Annotated[float, partial(number, least=0.0)]
Vector3 = Annotated[Sequence[float], partial(finite_numbers, size=3)]
NUMBERS: dict[Any, Check] = {float: real, int: whole}


def set_frozen(record: object, **values: object) -> None:
    """Set fields of a frozen dataclass; only for its own `__post_init__`."""
    put = object.__setattr__  # looked up once: a hierarchy is made in each tick of an adapter
    for name, value in values.items():
        put(record, name, value)


def check_fields(record: object, what: str, plain: Mapping[Any, Check] = NUMBERS,
                 free: Collection[str] = ()) -> None:
    """Raise a HierarchyError for a field that is not what its type asks for; make numbers floats.

    plain : checks of types that are not Annotated. free : names of fields that need none of these.
    """
    for name, kind, optional, check, unit in _asked(type(record)):  # type: ignore[arg-type]
        check = check or (None if name in free else plain.get(kind))
        value = getattr(record, name)
        if check is not None and not (optional and value is None):
            found = check(f"{what}: {name}{unit}", value)
            if kind in NUMBERS:
                set_frozen(record, **{name: found})


@cache
def _asked(kind: type) -> list[tuple[str, Any, bool, Check | None, str]]:
    """Return name, type, whether None will do, check and unit of each field that can be given."""
    hints, asked = _hints(kind), []
    for field in (field for field in fields(kind) if field.init):
        hint: Any = hints.get(field.name)
        others = [part for part in get_args(hint) if part is not NoneType]
        optional = NoneType in get_args(hint) and len(others) == 1
        hint = others[0] if optional else hint
        check, *unit = getattr(hint, "__metadata__", (None,))
        own = hint if check is None else hint.__origin__
        if get_origin(own) is Literal:
            check = partial(check_choice, known=get_args(own))
        asked.append((field.name, own, optional, check, "".join(f" [{one}]" for one in unit)))
    return asked


def _hints(kind: type) -> dict[str, Any]:
    """Return the types of fields; of a class that names unknown ones, those of its base."""
    for owner in kind.__mro__:
        with suppress(Exception):  # a user may annotate with anything
            return get_type_hints(owner, include_extras=True)
    return {}
