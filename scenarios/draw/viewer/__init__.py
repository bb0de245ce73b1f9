"""Runs in the browser: finished ones with a time cursor, and live ones."""
