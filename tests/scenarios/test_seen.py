"""What a user sees of short runs, keys and robot files is as it was: see tests/helpers/seen.py."""

import gzip
import json
from operator import eq

import pytest
from pinned import FOLDER, leaves
from seen import PARTS, PLAIN, alike, seen


@pytest.fixture(scope="module")
def before():
    return json.loads(gzip.decompress((FOLDER / "seen.json.gz").read_bytes()))


@pytest.mark.parametrize("part", PARTS)
def test_what_is_seen_is_as_it_was(part, before):
    if part not in PLAIN:
        pytest.importorskip("mujoco")
    same = eq if part == "computed defaults" else alike  # numbers as they are written
    found, expected = leaves(seen(part)), leaves(before[part])
    assert found.keys() == expected.keys()
    assert {place: (value, expected[place]) for place, value in found.items()
            if not same(value, expected[place])} == {}
