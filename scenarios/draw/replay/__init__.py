"""Replays of runs: one self-contained HTML file."""

from scenarios.draw.replay.page import html

__all__ = ["html"]
