"""The scene `stand`: inverse dynamics of a humanoid on two feet, beside other packages.

Imports are minimal, since these files also run in the environments of the other packages.
"""
