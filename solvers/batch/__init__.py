"""Many hierarchies of one shape at once, on all cores, or on an accelerator with `on_jax`."""

from solvers.batch.stacked import Batch, BatchResolution, cores, solve

__all__ = ["Batch", "BatchResolution", "cores", "solve"]
