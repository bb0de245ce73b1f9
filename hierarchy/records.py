"""Fields that a frozen dataclass computes from its others."""



def set_frozen(record: object, **values: object) -> None:
    """Set fields of a frozen dataclass; only for its own `__post_init__`."""
    put = object.__setattr__  # looked up once: a hierarchy is made in each tick of an adapter
    for name, value in values.items():
        put(record, name, value)
