"""The validated form of a scenario file, a file for each of its sections, and how it is read."""

from scenarios.config.errors import ScenarioError
from scenarios.config.reading import load, shipped
from scenarios.config.scenario import Scenario

__all__ = ["Scenario", "ScenarioError", "load", "shipped"]
