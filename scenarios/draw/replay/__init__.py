"""Replays of runs: one self-contained HTML file."""
