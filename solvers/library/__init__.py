"""The resolvers as a C library: the same compiled kernels, without Python."""

from solvers.library.folder import TARGETS, Written, differs, write

__all__ = ["TARGETS", "Written", "differs", "write"]
