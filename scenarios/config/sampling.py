"""Draw the values of a sample, and put them into a scenario."""

import hashlib
from collections.abc import Mapping

import numpy as np

from scenarios.config.changes import matching, place
from scenarios.config.distributions import Distribution, Value
from scenarios.config.scenario import Scenario
from scenarios.config.sections import naming


def drawn(scenario: Scenario, parameters: Mapping[str, Distribution], seed: int, index: int,
          what: str = "variation") -> dict[str, Value]:
    """Return the values of sample `index` by dotted key, for one scenario.

    They depend only on the seed, the index and the key, "around" also on the scenario's own value.
    A `*` in a key stands for every entry of a list, each with a draw of its own.

    Raises
    ------
    ScenarioError : the scenario does not have a key, or has no suitable value there; the message
        starts with `what` and the key.
    """
    own = scenario.model_dump(mode="json")
    values = {}
    for pattern, distribution in parameters.items():
        with naming(f"{what}.{pattern}: scenario {scenario.name!r}", of=ValueError):
            for key in matching(own, pattern):
                table, last = place(own, key)
                here = table[last] if isinstance(table, list) else table.get(last)
                # The same numbers on every machine, for one parameter of one sample.
                words = np.frombuffer(hashlib.sha256(key.encode()).digest()[:16], dtype="<u4")
                chance = np.random.PCG64(np.random.SeedSequence([seed, index, *words.tolist()]))
                values[key] = distribution.draw(np.random.Generator(chance), here)
    return values


def changed(scenario: Scenario, values: Mapping[str, Value], what: str) -> Scenario:
    """Return the scenario with other values at dotted keys.

    Raises ScenarioError for invalid ones; the message starts with `what` and has the values.
    """
    drawn_values = ", ".join(f"{key} = {value}" for key, value in values.items())
    return scenario.with_changes(values, f"{what}, with {drawn_values}")
