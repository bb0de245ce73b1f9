"""What a user sees of short runs and of robot files is as it was: see tests/helpers/seen.py."""

import pytest
from pinned import leaves, read
from seen import PARTS, PLAIN, seen


@pytest.mark.parametrize("part", PARTS)
def test_what_is_seen_is_as_it_was(part):
    if part not in PLAIN:
        pytest.importorskip("mujoco")
    found, expected = leaves(seen(part)), leaves(read("seen")[part])
    assert found.keys() == expected.keys()
    near = {place: pytest.approx(value, rel=1e-6, abs=1e-9) if isinstance(value, float) else value
            for place, value in expected.items()}
    assert {place: (value, near[place]) for place, value in found.items()
            if value != near[place]} == {}
