"""Reading and validating scenario files; one module per section."""

from scenarios.config.reading import is_shipped, load, members, shipped, shipped_groups
from scenarios.config.scenario import Scenario
from scenarios.config.sections import ScenarioError

__all__ = ["Scenario", "ScenarioError", "is_shipped", "load", "members", "shipped",
           "shipped_groups"]
