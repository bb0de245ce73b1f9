"""The problems of the open benchmark: families, public and from a seed, with proved answers."""
