"""Packages of control and inverse kinematics as entrants: one module for each."""
