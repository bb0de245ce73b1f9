"""A wheel builds, and works in an environment that has the core's dependencies and nothing else."""

import json
import os
import shutil
import subprocess
import sys
import venv
from importlib.metadata import distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
OUTSIDE = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
UNCOMPILED = {**OUTSIDE, "NUMBA_DISABLE_JIT": "1"}  # kernels run as plain Python


def run(*command, code=0, **kept):
    """What a command printed, or what it complained of where it is to end with another code."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False,
                          **{"env": OUTSIDE, **kept})
    assert done.returncode == code, done.stdout[-2000:] + done.stderr[-4000:]
    return done.stderr if code else done.stdout


def needed(package, extras=(), found=None):
    """All distributions that a package needs to run, itself not among them."""
    found = {} if found is None else found
    for line in distribution(package).requires or ():
        one = Requirement(line)
        if one.marker and not any(one.marker.evaluate({"extra": e}) for e in ("", *extras)):
            continue
        if one.name == package:
            needed(package, one.extras, found)
        elif one.name not in found:
            found[one.name] = distribution(one.name)
            needed(one.name, one.extras, found)
    return found


@pytest.fixture(scope="module")
def clean(tmp_path_factory):
    """An environment with the wheel and what its core needs, linked from this one: no network."""
    folder = tmp_path_factory.mktemp("dist")
    source = shutil.copytree(ROOT, folder / "source", ignore=shutil.ignore_patterns(
        ".*", "runs", "build", "dist", "tests", "docs", "*.egg-info", "__pycache__"))
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source)
    venv.create(folder / "venv", with_pip=False, symlinks=True)
    python = folder / "venv" / "bin" / "python"
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    for one in needed("task-hierarchy", ("scenarios",)).values():
        for top in {path.parts[0] for path in one.files} - {"..", "__pycache__"}:
            if not (site / top).exists():
                (site / top).symlink_to(Path(one.locate_file(top)).resolve())
    [wheel] = folder.glob("*-any.whl")
    run(sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index",
        "--quiet", "--disable-pip-version-check", wheel)
    return folder / "venv" / "bin"


def test_it_runs_from_outside_the_source_with_core_dependencies_alone(clean, tmp_path):
    found = json.loads(run(clean / "hierarchy", "run", "ellipse", "--duration", "0.02", "--out",
                           "a", "--json", cwd=tmp_path, env=UNCOMPILED))
    assert (found["ticks"], found["fault"]) == (20, None)
    where = run(clean / "python", "-c", "import scenarios; print(scenarios.__file__)", cwd=tmp_path)
    assert str(clean.parent) in where
    assert (tmp_path / "a" / "run.npz").is_file()


def test_what_needs_an_extra_says_which(clean, tmp_path):
    scheduler = ["sweep", "ellipse-starts", "--scheduler", "tcp://127.0.0.1:9"]
    for extra, command in {"sim": ["run", "human"], "sweep": scheduler}.items():
        said = run(clean / "hierarchy", *command, code=2, cwd=tmp_path, env=UNCOMPILED)
        assert f"pip install 'task-hierarchy[{extra}]'" in said
        assert "Traceback" not in said


@pytest.mark.parametrize("command", [["bench", "open", "--fresh", "1"], ["reproduce", "--quick"]])
def test_what_needs_a_checkout_says_so(clean, tmp_path, command):
    said = run(clean / "hierarchy", *command, code=2, cwd=tmp_path)
    assert f"`hierarchy {command[0]}` is not part of the installed package" in said


def test_every_shipped_file_is_in_the_wheel(clean, tmp_path):
    text = "from pathlib import Path; import scenarios; print(Path(scenarios.__file__).parent)"
    installed = Path(run(clean / "python", "-c", text, cwd=tmp_path).strip())
    shipped = [path for path in (ROOT / "scenarios").rglob("*")
               if path.is_file() and "__pycache__" not in path.parts]
    assert len(shipped) > 100
    missing = [path.name for path in shipped
               if not (installed.parent / path.relative_to(ROOT)).is_file()]
    assert missing == []
