"""Records are frozen: what was handed over cannot be changed behind the back of who holds it."""

from dataclasses import fields, is_dataclass
from importlib import import_module
from pkgutil import walk_packages

import pytest

import hierarchy
import scenarios.measure
import solvers

PACKAGES = (hierarchy, solvers, scenarios.measure)
CHANGED_IN_PLACE = {"solvers.resolvers.hqp._Cascade"}


def records(package):
    """Every dataclass that is defined in a package whose modules can be imported here."""
    for module in walk_packages(package.__path__, f"{package.__name__}."):
        try:
            found = vars(import_module(module.name)).values()
        except ImportError:  # an optional package is missing
            continue
        yield from (one for one in found if isinstance(one, type) and is_dataclass(one)
                    and one.__module__ == module.name)


@pytest.mark.parametrize("package", PACKAGES, ids=lambda package: package.__name__)
def test_records_are_frozen_and_what_they_compute_is_neither_shown_nor_compared(package):
    loose = {f"{one.__module__}.{one.__qualname__}" for one in records(package)
             if not one.__dataclass_params__.frozen}
    assert loose == {name for name in CHANGED_IN_PLACE if name.startswith(package.__name__)}
    computed = [(f"{one.__qualname__}.{field.name}", field) for one in records(package)
                if f"{one.__module__}.{one.__qualname__}" not in CHANGED_IN_PLACE
                for field in fields(one) if not field.init]
    assert [name for name, field in computed if field.repr or field.compare] == []
