"""Drawings of runs: figures, the replay of one file, the viewer in a browser."""
