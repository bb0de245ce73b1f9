"""Where distances come from: known geometry, or depth images."""

from scenarios.sensors.depth_sensor import DepthSensor
from scenarios.sensors.exact import ExactDistances

Sensor = ExactDistances | DepthSensor

__all__ = ["DepthSensor", "ExactDistances", "Sensor"]
