"""Kernels compiled when the package is built: the jobs that say which, and the command."""
