"""The benchmarks: families of questions x entrants x processes -> raw rows -> judge -> page.

Part of a checkout, not of the installed package; `hierarchy bench` finds it there. The modules that
a worker's process imports need only numpy, since they also run in the environments of others.
"""
