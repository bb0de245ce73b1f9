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


def breaking(name, begin):
    """An entrant that does something with a problem before it answers."""
    return type(name, (LeastSquares,), {"solve": lambda self, prepared: (
        begin(prepared), LeastSquares.solve(self, prepared))[1]})


def for_ever(prepared):
    while len(prepared.reference) == 1:
        pass


def raises(prepared):
    print("noise")  # where rows are expected
    raise ArithmeticError("not today")


def at_two(prepared):
    return prepared.lower[0] == 2.0


Crashing = breaking("Crashing", lambda one: at_two(one) and os.kill(os.getpid(), signal.SIGKILL))
Hanging = breaking("Hanging", lambda one: at_two(one) and time.sleep(1000.0))
Slow, Raising = breaking("Slow", for_ever), breaking("Raising", raises)
Doomed = breaking("Doomed", lambda _: os._exit(3))


class Moody(LeastSquares):
    """Never gives the same bits twice, and never calls its answer solved."""

    random = np.random.default_rng()

    def solve(self, prepared):
        return super().solve(prepared) + 1e-12 * self.random.normal(size=len(prepared.reference))

    def read(self, raw):
        return Answer(raw, solved=False)
