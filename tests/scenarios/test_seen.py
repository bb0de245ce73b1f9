"""What a user sees of short runs, keys and robot files is as it was: see tests/helpers/seen.py."""

import gzip
import json
from operator import eq

import pytest
from seen import FILE, PARTS, PLAIN, alike, seen


@pytest.fixture(scope="module")
def before():
    return json.loads(gzip.decompress(FILE.read_bytes()))


def leaves(value, path=""):
    """What is in nested lists and dictionaries, by its place."""
    if not isinstance(value, (dict, list)):
        return {path: value}
    items = value.items() if isinstance(value, dict) else enumerate(value)
    return {place: leaf for key, one in items
            for place, leaf in leaves(one, f"{path} {key}").items()}


@pytest.mark.parametrize("part", PARTS)
def test_what_is_seen_is_as_it_was(part, before):
    if part not in PLAIN:
        pytest.importorskip("mujoco")
    same = eq if part == "computed defaults" else alike  # numbers as they are written
    found, expected = leaves(seen(part)), leaves(before[part])
    assert found.keys() == expected.keys()
    assert {place: (value, expected[place]) for place, value in found.items()
            if not same(value, expected[place])} == {}
