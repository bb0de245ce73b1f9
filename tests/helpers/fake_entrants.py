"""Entrants that break the rules, one way each; they need only numpy."""

import os
import signal
import time

import numpy as np

from benchmark.solve.interface import Answer, Solver


class LeastSquares(Solver):
    """Right where the first level is all there is; the same bits each time."""

    def version(self):
        return "fake 1"

    def solve(self, prepared):
        return np.linalg.lstsq(prepared.A, prepared.lower)[0]

    def read(self, raw):
        return Answer(raw, solved=True, iterations=3)


class Crashing(LeastSquares):
    """Ends its process at the problem whose first side is 2."""

    def solve(self, prepared):
        if prepared.lower[0] == 2.0:
            os.kill(os.getpid(), signal.SIGKILL)
        return super().solve(prepared)


class Hanging(LeastSquares):
    """Never comes back from the problem whose first side is 2."""

    def solve(self, prepared):
        while prepared.lower[0] == 2.0:
            pass
        return super().solve(prepared)


class Slow(LeastSquares):
    """Never comes back from a problem of one unknown."""

    def solve(self, prepared):
        if len(prepared.reference) == 1:
            time.sleep(1000.0)
        return super().solve(prepared)


class Raising(LeastSquares):
    """Raises, and prints where rows are expected."""

    def solve(self, prepared):
        print("noise")
        raise ArithmeticError("not today")


class Doomed(LeastSquares):
    """Ends its process every time."""

    def solve(self, prepared):
        os._exit(3)


class Moody(LeastSquares):
    """Never gives the same bits twice, and never calls its answer solved."""

    def __init__(self, scale=1e-12):
        self.random = np.random.default_rng()
        self.scale = scale

    def solve(self, prepared):
        x = super().solve(prepared)
        return x + self.scale * self.random.normal(size=len(x))

    def read(self, raw):
        return Answer(raw, solved=False)
