"""Adapters: problems from pink, mink and MuJoCo, and answers for pink."""
