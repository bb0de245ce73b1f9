"""Reading and validating scenario files; one module per section."""

from scenarios.config.errors import ScenarioError
from scenarios.config.reading import load, shipped
from scenarios.config.scenario import Scenario

__all__ = ["Scenario", "ScenarioError", "load", "shipped"]
