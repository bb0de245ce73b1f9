"""Problems as files: written, read again in three languages, and refused where damaged."""

import io
import shutil
import subprocess
import zipfile
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from refusals import refused

from hierarchy import Hierarchy
from solvers import certify, make, problems
from solvers.problems import KINDS, Recipe, structured
from solvers.problems.files import Collection, Head, ProblemFileError, read
from solvers.proof import prove

HUGE = 2**63 - 1
READERS = Path(__file__).parents[2] / "examples" / "problems"


@pytest.fixture(scope="module")
def collection():
    found = tuple(problems.structured(seed) for seed in range(4))
    answers = tuple(prove(h, [make("hcod").solve(h).x]) for h in found)
    return Collection(Head("mixed", "four kinds", "fresh", 3), found, answers)


@pytest.fixture
def file(collection, tmp_path):
    collection.save(tmp_path / "mixed.npz")
    return tmp_path / "mixed.npz"


def test_a_file_has_what_was_written_to_the_last_bit(collection, file):
    again = read(file)
    assert (again.head, again.digest) == (collection.head, collection.digest)
    for one, other in zip(collection.problems, again.problems, strict=True):
        for name in ("A", "lower", "upper", "sizes", "reference"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for one, other in zip(collection.answers, again.answers, strict=True):
        np.testing.assert_array_equal(one.x, other.x)
        np.testing.assert_array_equal(one.least, other.least)
        assert one.judged == other.judged


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++")
def test_the_reader_in_cpp_finds_the_same_numbers(collection, file, tmp_path):
    program = tmp_path / "reader"
    subprocess.run(["g++", "-std=c++17", "-Wall", "-Werror", READERS / "read_problems.cpp",
                    "-o", program], check=True)
    lines = subprocess.run([program, file], text=True, capture_output=True,
                           check=True).stdout.splitlines()
    for p, (line, h) in enumerate(zip(lines, collection.problems, strict=True)):
        head, _, total = line.rpartition(" ")
        assert head == f"{p}: n {h.n}, rows {h.m}, sum of A"
        assert float(total) == pytest.approx(h.A.sum(), abs=1e-12)
    other = tmp_path / "other.npz"
    np.savez(other, levels=np.ones(1))
    missing = tmp_path / "missing.npz"
    for arguments, why in (([], ": give one FILE.npz"),
                           ([missing], f": {missing}: cannot be opened"),
                           ([other], f": {other}: has no array n")):
        refused = subprocess.run([program, *arguments], text=True, capture_output=True)
        assert (refused.returncode, refused.stderr) == (2, f"read_problems{why}\n")


def rewritten(path, compression=zipfile.ZIP_STORED, **content):
    """Write an archive anew with other members: arrays, bytes, or a function of the bytes."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    for name, value in content.items():
        member = "head.json" if name == "head" else f"{name}.npy"
        if isinstance(value, np.ndarray):
            stream = io.BytesIO()
            np.save(stream, value)
            value = stream.getvalue()
        members[member] = value(members[member]) if callable(value) else value
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, value in members.items():
            if value is not None:
                archive.writestr(name, value)


def header(shape, write=np.lib.format.write_array_header_1_0):
    stream = io.BytesIO()
    write(stream, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return stream.getvalue()


def three_rows():
    """Three rows in two unknowns."""
    return Hierarchy([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]], [1.0, 2.0, -np.inf], [1.0, 2.0, 9.0],
                     [2, 1])


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.npz"
    Collection(Head("mixed", "", "fresh", 3), (three_rows(),) * 2).save(path)
    return path


@pytest.mark.parametrize(("content", "said"), [
    ({"head": lambda head: head.replace(b'"seed": ', b'"seed": -0.')}, "seed is -0"),
    ({"head": lambda head: head.replace(b'"family"', b'"famile"')}, "family is missing"),
    ({"head": b"[]"}, 'does not say "format"'), ({"n": np.array([2, -1])}, "n = -1"),
    ({"head": b"{"}, "head.json is not JSON"), ({"head": b"[" * 10**6}, "is nested too deep"),
    ({"head": None}, "not a file of problems: head.json is missing"),
    ({"head": lambda head: head.replace(b'"version": 1', b'"version": 9')},
     "version 9 of the format; known is 1"),
    ({"head": lambda head: head.replace(b'"count": ', b'"count": 1')}, "says 1"),
    ({"A": None}, "not a file of problems: A.npy is missing"),
    ({"A": lambda data: data[:-8] + b"\0\0\0\0\0\0\1\0"}, "SHA-256"),
    ({"A": header((10**15,))}, "A: its header says 8000000000000000 bytes, and 0 follow"),
    ({"A": header((10**15,), np.lib.format.write_array_header_2_0)}, "A: its header says 8000000"),
    ({"upper": lambda data: data.replace(b"<f8", b"<f4")}, "expected one dimension"),
    ({"sizes": np.array([10**9, 1, 2, 1])}, "problem 0 needs 2000000002 more numbers"),
    ({"levels": np.array([3, 3]), "sizes": np.array([HUGE, HUGE, 5] * 2)}, "A is too short"),
    ({"lower": np.zeros(5)}, "lower is too short: problem 1 needs 3 more numbers, there are 2"),
    ({"upper": np.array([1.0, 2, 9, 1, 2, -np.inf])}, "problem 1, level 2, row 0: no value"),
    ({"reference": np.array([0.0, np.nan, 0, 0])}, "problem 0, reference, entry 1: nan"),
    ({"n": np.array([2])}, "n is of 1 problems and levels of 2"),
    ({"levels": np.array([HUGE, 2])}, "sizes is too short")])
def test_a_damaged_file_is_refused_and_the_reason_named(small, content, said):
    rewritten(small, **content)
    assert str(small) in refused(said, read, small, error=ProblemFileError)


def test_an_archive_is_refused_that_unpacks_to_more_than_it_may(small, monkeypatch):
    rewritten(small, zipfile.ZIP_DEFLATED, more=bytes(2**22))
    assert small.stat().st_size < 2**14
    assert len(read(small).problems) == 2
    monkeypatch.setattr("hierarchy.archives.LARGEST", 2**21)
    with pytest.raises(ProblemFileError, match=r"it unpacks to 419.* bytes, more than 2097152"):
        read(small)


@pytest.mark.parametrize(("change", "said"), [
    ({"head": Head("a", "", "fresh", np.int64(3))}, "seed is np.int64(3) in its head.json"),
    ({"head": Head("a", "", "fresh", 3, period=np.nan)}, "nan"),
    ({"problems": (three_rows().changed(lower=[np.nan, 0.0, 0.0]),)}, "level 1, row 0: lower is"),
    ({"problems": (three_rows().changed(metric=np.eye(2)),)}, "problem 0 has a metric"),
    ({"problems": (three_rows().changed(give=[0.0, 0.0, 0.1]),)}, "problem 0 gives"),
    ({"answers": ()}, "x is too short: problem 0 needs")])
def test_what_could_not_be_read_is_not_written(small, change, said):
    before, one = small.read_bytes(), Collection(Head("a", "", "fresh", 3), (three_rows(),))
    refused(said, replace(one, **change).save, small)
    assert small.read_bytes() == before


def test_a_file_of_problems_is_written_where_it_is_read(small, tmp_path, monkeypatch):
    """A path with ~ went to a folder of that name, which is seldom there."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    collection = read(small)
    collection.save("~/again.npz")
    assert read("~/again.npz").digest == collection.digest
    refused("save: expected a path, got NoneType None", collection.save, None)


def test_a_single_hierarchy_in_a_file_passes_the_same_gate(tmp_path):
    path, h = tmp_path / "one.npz", problems.generate(3)
    h = h.changed(metric=2.0 * np.eye(h.n), give=np.full(h.m, 0.1))
    problems.save(h, path)
    again = problems.load(path)
    assert again.names == h.names
    for part in ("A", "lower", "upper", "sizes", "offsets", "reference", "metric", "give"):
        np.testing.assert_array_equal(getattr(again, part), getattr(h, part))
    for content, said in (({"lower": np.zeros(2)}, "lower has shape (2,), expected (3,)"),
                          ({"sizes": np.array([2, 10**9])}, "level 2: size 1000000000"),
                          ({"A": header((10**15, 2))}, "A.npy: its header says")):
        problems.save(three_rows(), path)
        rewritten(path, **content)
        refused(f"{path} cannot be read as a hierarchy: {said}", problems.load, path)


def test_what_is_no_file_of_problems_is_refused(tmp_path):
    refused("does not exist", read, tmp_path / "none.npz", error=ProblemFileError)
    (tmp_path / "text.npz").write_text("text")
    text = refused("not a file of problems", read, tmp_path / "text.npz", error=ProblemFileError)
    assert text.endswith(": File is not a zip file")
    refused("read: expected a path, got int 3", read, 3)


@pytest.mark.parametrize(("make_one", "wrong", "said"), [
    *((made, -1, "seed = -1: expected a whole number") for made in (
        structured, partial(problems.family, "EQ7"), partial(problems.bounded, structured(0)))),
    *((lambda wrong, knob=knob: Recipe(**{knob: wrong}), wrong, f"recipe: {knob}")
      for knob, wrong in (
          ("joints", (0, 5)), ("joints", (5, 2)), ("rows", (-1, 3)), ("spread", 0.5), ("ties", 1.5),
          ("scales", (1.0, np.inf)), ("empty", np.nan), ("joints", None), ("equalities_only", 1)))])
def test_a_seed_or_a_knob_out_of_range_is_named(make_one, wrong, said):
    refused(said, make_one, wrong)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(problems.strategy(Recipe(joints=(1, 8), levels=(1, 4), rows=(0, 6), equalities_only=True)))
def test_hypothesis_draws_the_same_kind_of_problem(h):
    assert h.n <= 8
    assert certify(h, make("tpm").solve(h).x).certified


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_a_valid_hierarchy_also_of_equalities_alone(kind):
    for seed in range(10):
        h = structured(seed, (kind,))
        Hierarchy.from_levels(list(h.levels()), h.reference)
        assert structured(seed, (kind,), equalities_only=True).is_equality
    refused("'arms'", structured, 0, ("arms",))
