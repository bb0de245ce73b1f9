"""A factorised hierarchy that follows edits of its levels without factoring all rows again."""

from solvers.factorization.edited import Factorization

__all__ = ["Factorization"]
