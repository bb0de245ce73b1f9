"""How well it went: metrics of runs, and where runs part that should agree."""
