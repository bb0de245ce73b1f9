"""Figures of runs: the letter's panels, the scene in space, the stack over time; one look."""
