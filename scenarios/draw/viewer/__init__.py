"""Runs in the browser: finished ones with a time cursor, and one that runs while it is watched."""
