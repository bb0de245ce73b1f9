"""What is drawn of a run, as arrays, independent of any drawing library."""
