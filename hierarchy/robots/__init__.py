"""Robots given as tables of numbers; `hierarchy.robot` turns one into a model."""

from hierarchy.robots.kuka_lwr import KUKA_LWR
from hierarchy.robots.table import DHTable

TABLES: dict[str, DHTable] = {KUKA_LWR.name: KUKA_LWR}

__all__ = ["KUKA_LWR", "TABLES", "DHTable"]
