"""Whole inverse kinematics beside other packages: poses reached, and the time for it."""
