"""What is kept of a run: its signals, the facts to read them by, and what became of each level."""
