"""The page that shows a comparison: one HTML file that needs nothing else."""

from scenarios.report.page import page

__all__ = ["page"]
