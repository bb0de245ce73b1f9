"""A run to look at again: one HTML file that needs nothing else, or a video."""

from scenarios.draw.replay.page import html

__all__ = ["html"]
