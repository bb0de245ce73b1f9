"""Quadratic programs: the backends, what they are asked, and how their answers are refined."""
