"""Replays of runs: one self-contained HTML file, or a video."""

from scenarios.draw.replay.page import html

__all__ = ["html"]
