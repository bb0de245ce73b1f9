"""The entrants: one file each; `scenarios.bench.open.table` has a row for every one."""
