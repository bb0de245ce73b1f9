"""Linear algebra of kernels: views of a work space, rows, reflections, least squares, blocks."""
