"""What plugins register is gone after a test."""

import sys
from contextlib import contextmanager
from unittest.mock import patch


@contextmanager
def unplugged():
    """No plugin is known at the beginning; what is loaded meanwhile is forgotten at the end."""
    from hierarchy import plugins
    from solvers.resolver import _REGISTRY

    plugins._points.cache_clear()
    with (patch.object(sys, "path", [*sys.path]), patch.dict(_REGISTRY),
          patch.multiple(plugins, _registered={group: {} for group in plugins.GROUPS}, _loaded={},
                         _flagged={})):
        try:
            yield
        finally:
            for module in (*plugins._loaded, "own_kinds"):
                sys.modules.pop(module, None)
            plugins._points.cache_clear()
