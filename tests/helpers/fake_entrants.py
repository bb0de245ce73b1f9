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

    def at_two(self):
        os.kill(os.getpid(), signal.SIGKILL)

    def solve(self, prepared):
        if prepared.lower[0] == 2.0:
            self.at_two()
        return super().solve(prepared)


class Hanging(Crashing):
    """Never comes back from it."""

    def at_two(self):
        time.sleep(1000.0)


class Slow(LeastSquares):
    """Works for ever on a problem of one unknown."""

    def solve(self, prepared):
        while len(prepared.reference) == 1:
            pass
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

    random = np.random.default_rng()

    def solve(self, prepared):
        return super().solve(prepared) + 1e-12 * self.random.normal(size=len(prepared.reference))

    def read(self, raw):
        return Answer(raw, solved=False)
