"""A hierarchy kept factorised while rows and levels join, leave and change."""

from solvers.factorization.edited import Factorization

__all__ = ["Factorization"]
