"""What a user sees of short runs, keys and robot files is as it was: see tests/helpers/seen.py."""

import gzip
import json

import pytest
from pinned import FOLDER, leaves
from seen import PARTS, PLAIN, seen


@pytest.fixture(scope="module")
def before():
    return json.loads(gzip.decompress((FOLDER / "seen.json.gz").read_bytes()))


@pytest.mark.parametrize("part", PARTS)
def test_what_is_seen_is_as_it_was(part, before):
    if part not in PLAIN:
        pytest.importorskip("mujoco")
    found, expected = leaves(seen(part)), leaves(before[part])
    assert found.keys() == expected.keys()
    near = {place: pytest.approx(value, rel=1e-6, abs=1e-9) if isinstance(value, float) else value
            for place, value in expected.items()}
    assert {place: (value, near[place]) for place, value in found.items()
            if value != near[place]} == {}
