"""Calls that are to be refused."""

import re

import pytest

from hierarchy import HierarchyError


def refused(said, call, *arguments, error=HierarchyError, **settings):
    """Check that a call raises an error with these words, and return its text."""
    with pytest.raises(error, match=re.escape(said)) as raised:
        call(*arguments, **settings)
    return str(raised.value)
