"""Questions to solvers: problems of prioritized control, their answers judged by x alone."""
