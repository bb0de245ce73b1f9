"""The resolvers as a C library: the same compiled kernels, without Python."""

from solvers.library.emission import TARGETS
from solvers.library.folder import Written, differs, write

__all__ = ["TARGETS", "Written", "differs", "write"]
