"""Where distances come from."""

from scenarios.sensors.exact import ExactDistances

__all__ = ["ExactDistances"]
