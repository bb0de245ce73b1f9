"""Figures of runs in one style: the letter's panels, the scene in space, the stack over time."""
