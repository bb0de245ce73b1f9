"""Calls that are to be refused."""

import re

import pytest

from hierarchy import HierarchyError


def refused(said, call, *arguments, error=HierarchyError, **settings):
    """Check that a call raises an error with these words."""
    with pytest.raises(error, match=re.escape(said)):
        call(*arguments, **settings)
