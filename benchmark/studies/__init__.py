"""Studies behind single pages: `python -m benchmark.studies.NAME`."""
