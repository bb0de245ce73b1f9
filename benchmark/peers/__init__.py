"""Scenes that other packages are asked: a tick of an arm or a humanoid, whole inverse kinematics.

A module named after a package adapts it, by functions `arm`, `stand` and `reach`; each runs in the
package's own environment and needs only numpy and the package.
"""
