"""Where distances come from: known geometry, or depth images."""

from scenarios.cell.sensors.depth_sensor import DepthSensor
from scenarios.cell.sensors.sensor import ExactDistances, Sensor

__all__ = ["DepthSensor", "ExactDistances", "Sensor"]
