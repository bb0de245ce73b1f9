"""The kinds of `[[tasks]]`: the keys of a kind, and the task that they make.

A file in this folder is a kind: nothing else lists them. Makers import what they make when they are
called, so that reading a file loads no robot.
"""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__):
    import_module(f"{__name__}.{_module.name}")
