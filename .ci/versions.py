"""Install the lowest or the newest versions of all ranges, run each size and the tests, and print
what ran.

`python .ci/versions.py lowest|newest`, in fresh environments under the temporary folder. Tests of
the wording of other packages, and of documents, are for the versions in constraints.txt.
"""

import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

ROOT = Path(__file__).parents[1]
EXTRAS = "robots", "scenarios", "qp", "sim", "sweep", "export", "tables"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def lowest():
    """Return the lower bound of each range, its last number free (`>=2.0` may have no 2.0)."""
    extras = PROJECT["optional-dependencies"]
    asked = [*PROJECT["dependencies"], *(one for extra in EXTRAS for one in extras[extra])]
    bounds = (re.match(r"([\w.-]+)>=([\d.]+)", one) for one in asked)
    return [f"{found[1]}=={found[2]}.*" for found in bounds if found]


def run(which, size):
    """Install one size in a fresh environment and use it; raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True, symlinks=True)
        python = Path(folder, "bin", "python")
        limits = Path(folder, "limits.txt")
        limits.write_text("\n".join(lowest() if which == "lowest" else []))
        asked = f"{ROOT}[{size}]" if size != "arrays" else str(ROOT)
        subprocess.run([python, "-m", "pip", "install", "--quiet", "--upgrade", "--constraint",
                        limits, asked], check=True)
        subprocess.run([python, "-m", "pip", "freeze"], check=True)
        subprocess.run([python, "-P", ROOT / ".ci" / "sizes.py", size], check=True, cwd=folder)
        if size == "scenarios":
            asked = f"{ROOT}[{','.join(EXTRAS)}]", "pytest", "hypothesis"
            subprocess.run([python, "-m", "pip", "install", "--quiet", "--constraint", limits,
                            *asked], check=True)
            ignored = "project", "scenarios/test_seen.py", "solvers/test_mink_kinds.py"
            subprocess.run([python, "-m", "pytest", "-q", "-W", "ignore::DeprecationWarning",
                            *(f"--ignore={ROOT / 'tests' / one}" for one in ignored),
                            ROOT / "tests"], check=True, cwd=ROOT)


if __name__ == "__main__":
    for size in ("arrays", "robots", "scenarios"):
        print(f"== {sys.argv[1]}, {size}", flush=True)
        run(sys.argv[1], size)
