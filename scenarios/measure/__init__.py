"""Metrics of runs, and where runs diverge that should agree."""
