"""Scenes that other packages are asked: a tick of an arm or a humanoid, whole inverse kinematics.

A module of `adapters` named after a package adapts it, by functions `arm`, `stand` and `reach`, and
by a class where it is also one of the solvers of `solve`; each runs in the package's own
environment and needs only numpy and the package.
"""
