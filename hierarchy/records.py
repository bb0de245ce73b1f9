"""Fields that a frozen dataclass computes from its others."""

from __future__ import annotations


def set_frozen(record: object, **values: object) -> None:
    """Set fields of a frozen dataclass; only for its own `__post_init__`."""
    for name, value in values.items():
        object.__setattr__(record, name, value)
