"""Problems as files: written, read again in three languages, and refused where damaged."""

import json
import shutil
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest

from hierarchy.errors import HierarchyError
from solvers import make, problems
from solvers.problems.files import Collection, Head, ProblemFileError, read
from solvers.proof import prove

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
    assert again.head == collection.head
    assert again.digest == collection.digest
    for one, other in zip(collection.problems, again.problems, strict=True):
        for name in ("A", "lower", "upper", "sizes", "reference"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    for one, other in zip(collection.answers, again.answers, strict=True):
        np.testing.assert_array_equal(one.x, other.x)
        np.testing.assert_array_equal(one.least, other.least)
        assert one.judged == other.judged


def test_numpy_alone_reads_a_file(collection, file):
    with np.load(file) as found:
        head = json.loads(found["head.json"])
        assert (head["version"], head["count"]) == (1, 4)
        assert found["A"].size == sum(h.A.size for h in collection.problems)


@pytest.mark.slow
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


def changed(file, name, content):
    """Write the file again with another member."""
    with zipfile.ZipFile(file) as archive:
        members = {one: archive.read(one) for one in archive.namelist()}
    members[name] = content(members[name])
    with zipfile.ZipFile(file, "w") as archive:
        for one, data in members.items():
            if data is not None:
                archive.writestr(one, data)


@pytest.mark.parametrize(("name", "content", "said"), [
    ("head.json", lambda _: b"{", "head.json is not JSON"),
    ("head.json", lambda _: b"[]", 'does not say "format"'),
    ("head.json", lambda head: head.replace(b'"version": 1', b'"version": 9'),
     "version 9 of the format; known is 1$"),
    ("head.json", lambda head: head.replace(b'"count": ', b'"count": 1'), "says 1"),
    ("head.json", lambda head: head.replace(b'"seed": ', b'"seed": -0.'), "seed is -0"),
    ("head.json", lambda head: head.replace(b'"family"', b'"famile"'), "family is missing"),
    ("A.npy", lambda _: None, "not a file of problems: A.npy is missing$"),
    ("head.json", lambda _: None, "not a file of problems: head.json is missing$"),
    ("A.npy", lambda data: data[:-8] + b"\0\0\0\0\0\0\1\0", "SHA-256"),
    ("n.npy", lambda data: data[:-8] + b"\xff" * 8, "n = -1"),
    ("sizes.npy", lambda data: data[:-8] + b"\x7f" + b"\0" * 7, "too short"),
    ("lower.npy", lambda data: data[:-8] + b"\xff" * 8, "lower is nan"),
    ("upper.npy", lambda data: data.replace(b"<f8", b"<f4"), "expected one dimension")])
def test_a_damaged_file_is_refused_and_the_reason_named(file, name, content, said):
    changed(file, name, content)
    with pytest.raises(ProblemFileError, match=said):
        read(file)


def test_what_is_no_file_of_problems_is_refused(tmp_path):
    with pytest.raises(ProblemFileError, match="does not exist"):
        read(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("text")
    with pytest.raises(ProblemFileError, match=r"not a file of problems: File is not a zip file$"):
        read(tmp_path / "text.npz")


def test_a_byte_that_changed_is_noticed(file):
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)
    with pytest.raises(ProblemFileError, match="CRC"):
        read(file)


@pytest.mark.parametrize(("what", "said"), [({"metric": [[2.0]]}, "has a metric"),
                                            ({"give": [0.1]}, "gives")])
def test_a_metric_and_levels_that_give_cannot_be_written(tmp_path, what, said):
    from hierarchy import Hierarchy

    h = Hierarchy.from_levels([([[1.0]], [1.0])], **what)
    with pytest.raises(HierarchyError, match=f"problem 0 {said}"):
        Collection(Head("one", "", "public", 0), (h,)).save(tmp_path / "one.npz")
