"""The C library as Python sees it through ctypes, beside the resolvers of the same names."""

import ctypes
import dataclasses
import shutil

import llvmlite.binding as llvm
import numpy as np

from hierarchy import HierarchyError
from solvers import make

NUMBERS, INTEGERS = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_int64)
SOLVED, ITERATION_LIMIT, NUMERICAL_FAILURE, INACCURATE = 0, 1, 2, 4
TOO_SMALL, CONTRADICTION, REFUSED, INVALID = 8, 10, 11, 12
CANARY = -3.14159e77
NAMES = ("hcod", "tpm", "recursive", "sns", "merged")
COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


class Problem(ctypes.Structure):
    _fields_ = [(name, ctypes.c_int64) for name in ("n", "m", "levels")] + [
        ("A", NUMBERS), ("lower", NUMBERS), ("upper", NUMBERS), ("sizes", INTEGERS),
        ("reference", NUMBERS)]


class Record(ctypes.Structure):
    _fields_ = [("values", NUMBERS)] + [
        (name, ctypes.c_int64) for name in ("size", "used", "warm", "iterations", "row")]


class Settings(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in (
        "damping", "threshold", "rank_tolerance", "tolerance", "isotropic", "largest", "ratio",
        "cap", "step", "regularisation")] + [(name, ctypes.c_int64) for name in (
            "max_iterations", "optimal", "miss", "method", "strict_levels")] + [
        ("scales", NUMBERS)]


def settings_of(**given):
    """Settings with the defaults of the header but for those given."""
    return Settings(**{"threshold": 0.1, "rank_tolerance": 1e-8, "tolerance": 1e-10,
                       "largest": np.inf, "ratio": 4.0, "cap": 1.0, "step": 0.1,
                       "regularisation": 1e-3, "max_iterations": 1000, "strict_levels": -1,
                       **given})


def problem_of(h, **changed):
    """A th_problem that reads the arrays of a hierarchy, with some fields changed."""
    fields = {"n": h.n, "m": h.m, "levels": len(h.sizes), "A": numbers(h.A),
              "lower": numbers(h.lower), "upper": numbers(h.upper),
              "sizes": h.sizes.ctypes.data_as(INTEGERS), "reference": numbers(h.reference)}
    return Problem(**{**fields, **changed})


def numbers(array):
    return array.ctypes.data_as(NUMBERS)


@dataclasses.dataclass
class Memory:
    """What a caller owns, each array followed by a canary."""

    record: Record
    x: np.ndarray
    values: np.ndarray
    work: np.ndarray

    @property
    def answer(self):
        return self.x[:-1]

    @property
    def untouched(self):
        return all(array[-1] == CANARY for array in (self.x, self.values, self.work))


class Library:
    """The object in a static library, loaded by LLVM: no linker is needed."""

    def __init__(self, folder):
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        self.engine = llvm.create_mcjit_compiler(
            llvm.parse_assembly(""), llvm.Target.from_default_triple().create_target_machine())
        content = (folder / "lib" / "libtask_hierarchy.a").read_bytes()
        start = content.index(b"kernels.o/") + 60
        self.engine.add_object_file(llvm.ObjectFileRef.from_data(content[start:]))
        self.engine.finalize_object()
        self.address = address = self.engine.get_function_address
        sizes = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_int64] * 3)
        self.work_size, self.record_size = (sizes(address(f"th_{name}_size"))
                                            for name in ("work", "record"))

    def memory(self, h, missing=0, missing_values=0):
        """Memory for a hierarchy, less so many numbers of work space and record."""
        sizes = h.n, h.m, len(h.sizes)
        values = np.full(self.record_size(*sizes) + 1 - missing_values, CANARY)
        work = np.full(self.work_size(*sizes) + 1 - missing, CANARY)
        return Memory(Record(numbers(values), len(values) - 1), np.full(h.n + 1, CANARY), values,
                      work)

    def call(self, name, problem, memory, settings=None, /, **changed):
        """One call, some of its pointers changed; returns the status."""
        given = {"problem": ctypes.addressof(problem),
                 "settings": None if settings is None else ctypes.addressof(settings),
                 "record": ctypes.addressof(memory.record), "x": memory.x.ctypes.data,
                 "work": memory.work.ctypes.data, **changed}
        solve = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 5, ctypes.c_int64)
        return solve(self.address(f"th_{name}"))(*given.values(), len(memory.work) - 1)

    def violations(self, problem, x, count):
        """Status and norms of th_violations; a canary behind the norms stays."""
        norms = np.full(count + 1, CANARY)
        call = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 3)
        status = call(self.address("th_violations"))(
            ctypes.addressof(problem), None if x is None else x.ctypes.data, norms.ctypes.data)
        assert norms[-1] == CANARY
        return status, norms[:-1]

    def solve(self, name, h, settings=None, memory=None):
        """Solve a hierarchy; return the status and what the caller then has."""
        memory = memory or self.memory(h)
        status = self.call(f"solve_{name}", problem_of(h), memory, settings)
        assert memory.untouched, "a number past the end of an array was written"
        return status, memory


def check_same(library, resolver, h, memory=None, before=None):
    """One solve in both, from memories of both; returns what Python leaves."""
    name, python, settings = resolver
    status, left = library.solve(name, h, settings_of(**settings), memory)
    try:
        res = make(name, **python).solve(h, before)
    except HierarchyError:
        assert status in (REFUSED, CONTRADICTION)
        assert 0 <= left.record.row < h.m
        assert not left.answer.any()
        return None
    assert left.answer.tobytes() == res.x.tobytes()
    assert status == res.status or (name, status) == ("tpm", ITERATION_LIMIT)
    assert left.record.iterations == res.iterations
    assert (left.record.warm == 1) == (res.memory is not None)
    if res.memory is not None:
        assert left.values[:left.record.used].tobytes() == res.memory.tobytes()
    return res
