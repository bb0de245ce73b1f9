"""Quadratic programs: the backends, the program of a level, and the refinement of answers."""
