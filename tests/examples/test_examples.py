"""The examples run, and print what they promise: strict levels beside how it is done otherwise."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
# Seconds of the run; at most this with strict levels, and at least that otherwise [mm, deg, ...].
PROMISES = {
    "humanoid": (3.0, 0.6, 10.0), "iiwa": (2.0, 0.3, 0.6), "mobile": (2.5, 0.5, 2.0),
    "panda": (2.5, 0.1, 4.0), "policy": (1.5, 0.6, 100.0), "quadruped": (1.5, 1.0, 2.0),
    "so101": (1.6, 0.1, 10.0), "teleop": (1.5, 15.001, 100.0), "wall": (1.6, 0.01, 100.0)}


@pytest.mark.slow
@pytest.mark.parametrize("name", PROMISES)
def test_an_example_keeps_what_it_promises_where_the_other_way_does_not(name, capsys):
    duration, most, least = PROMISES[name]
    strict, other = loaded(name).main(duration)
    assert strict <= most
    assert other >= least
    assert len(capsys.readouterr().out.splitlines()) == 1


@pytest.mark.parametrize("name", PROMISES)
def test_an_example_is_short_and_says_first_what_it_shows(name):
    text = (EXAMPLES / f"{name}.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 75
    assert re.match(r'"""[A-Z].*\n\nLevels: ', text)


def loaded(name):
    """The module of an example."""
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
