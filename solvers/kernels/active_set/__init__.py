"""The exact engine: a working set found level by level, searched on from there, and verified."""
