"""Use the installed package as its size allows: `python .ci/sizes.py arrays|robots|scenarios`."""

import subprocess
import sys
import tempfile

from task_hierarchy import Hierarchy, certify, make

SIZES = ("arrays", "robots", "scenarios")
REFUSED = "import task_hierarchy; task_hierarchy.{}"


def refuses(name, size):
    """Whether a name of a larger size is refused with the line that installs it."""
    done = subprocess.run([sys.executable, "-P", "-c", REFUSED.format(name)], capture_output=True,
                          text=True, check=False)
    return f"pip install 'task-hierarchy[{size}]'" in done.stderr


def main(size):
    """Solve, load a robot, simulate; raises AssertionError."""
    h = Hierarchy.from_levels([([[1, 0], [0, 1]], [-0.1] * 2, [0.1] * 2), ([[1.0, 0.5]], [0.3])])
    for name in ("tpm", "hcod", "weighted"):
        assert name == "weighted" or certify(h, make(name).solve(h).x).certified, name
    if size == "arrays":
        assert refuses("Robot", "robots")
        return
    from task_hierarchy import Robot

    Robot.load("kuka_lwr")
    if size == "robots":
        assert refuses("simulate", "scenarios")
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, "-P", "-c", "from task_hierarchy import main; main()",
                        "run", "ellipse", "--duration", "0.02", "--out", f"{folder}/a"], check=True)


if __name__ == "__main__":
    main(SIZES[SIZES.index(sys.argv[1])])
