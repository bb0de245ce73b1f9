"""A recorded run: its signals, the facts to read them by, and whether each level was met."""
