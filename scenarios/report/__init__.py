"""The page that shows a comparison: one HTML file that needs nothing else."""

from scenarios.report.page import comparison_page

__all__ = ["comparison_page"]
