"""Export of recordings as MCAP, with a layout for Foxglove."""

from scenarios.export.mcap import export

__all__ = ["export"]
