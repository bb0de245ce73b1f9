"""An MJCF as MuJoCo compiles it, with a name for everything in it; which part is the robot."""

import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import OF_PROCESS, RobotError, check_name, naming
from hierarchy.problem import Array
from hierarchy.robots.joints import Part as JointPart
from hierarchy.robots.joints import set_joint
from hierarchy.robots.table import Base
from hierarchy.words import each

KINDS = ("free", "ball", "slide", "hinge")  # as MuJoCo numbers the types of joints
_PLACES = {"free": (0, 1, 2, 4, 5, 6, 3), "ball": (1, 2, 3, 0), "slide": (0,), "hinge": (0,)}
WORLD = 0                                   # index of the body that does not move
_REMEDY = "pip install 'task-hierarchy[sim]'"


@dataclass(frozen=True)
class Compiled:
    """A compiled `model` (mujoco.MjModel), and a name for each of its joints, bodies, sites, keys.

    What the file leaves nameless is called after its body or its index. `missing` are sentences.
    """

    file: str
    model: Any
    joints: tuple[str, ...]
    bodies: tuple[str, ...]
    sites: tuple[str, ...]
    keys: tuple[str, ...]
    missing: tuple[str, ...]

    def kind(self, joint: int) -> str:
        """Return "free", "ball", "slide" or "hinge"."""
        return KINDS[self.model.jnt_type[joint]]

    def places(self, joint: int) -> list[int]:
        """Return where in qpos our coordinates of a joint are: quaternions are w, x, y, z there."""
        return [int(self.model.jnt_qposadr[joint]) + i for i in _PLACES[self.kind(joint)]]

    def error(self, said: str) -> RobotError:
        """Return an error that names the file."""
        return RobotError(f"robot file {self.file!r}: {said}")


def compiled(path: Path) -> Compiled:
    """Let MuJoCo compile a file; raises RobotError if it is not installed or refuses the file."""
    file = str(path)
    try:
        import mujoco
    except ImportError as error:
        raise RobotError(f"robot file {file!r}: an MJCF is compiled by MuJoCo, which is not "
                         f"installed: {_REMEDY}") from error
    with OF_PROCESS, warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            model = (_compiled(mujoco.MjSpec.from_file(file)) if path.suffix == ".xml" else
                     mujoco.MjModel.from_xml_path(file))  # MjSpec reads no other suffix
        except (ValueError, RuntimeError) as error:
            said = _in_one_line(str(error))
            raise RobotError(f"robot file {file!r} cannot be read: {said}") from error
    missing = tuple(dict.fromkeys(f"MuJoCo warns: {_in_one_line(str(one.message))}"
                                  for one in warned))
    bodies = _names(model, "body", model.nbody)
    of_body = [f"{bodies[body]} {KINDS[kind]}"
               for body, kind in zip(model.jnt_bodyid, model.jnt_type, strict=True)]
    found = Compiled(file, model, _names(model, "joint", model.njnt, of_body), bodies,
                     _names(model, "site", model.nsite), _names(model, "key", model.nkey), missing)
    for what in _without_number(model):
        raise found.error(f"{what} is not a number")
    return found


def _without_number(model: Any) -> Iterator[str]:
    """Yield what of a model is NaN, which MuJoCo only prints a warning about."""
    for part in (model, model.opt):
        for name in dir(part):
            values = getattr(part, name)
            if isinstance(values, np.ndarray) and values.dtype.kind == "f" and (
                    found := np.argwhere(np.isnan(values))).size:
                kind = _OBJECTS.get(name.partition("_")[0])
                yield f"{name} of {kind} {name_of(model, kind, found[0, 0])!r}" if kind else name


_OBJECTS = {"jnt": "joint", "eq": "equality"} | {kind: kind for kind in (
    "body", "geom", "site", "tendon", "actuator", "key")}  # by how names of arrays begin


def _compiled(spec: Any) -> Any:
    """Compile without visual meshes, which take most of the time and may be missing.

    MuJoCo refuses that where it would change a mass; then with it.
    """
    spec.compiler.discardvisual, asked = True, spec.compiler.discardvisual
    try:
        return spec.compile()
    except ValueError:
        spec.compiler.discardvisual = asked
        return spec.compile()


def _in_one_line(text: str) -> str:
    return " ".join(text.removeprefix("Error: ").split())


def disabled(model: Any, what: str) -> bool:
    """Return whether the options of a model disable "gravity", "limit" or another part."""
    import mujoco

    bit, every = (getattr(mujoco.mjtDisableBit, f"mjDSBL_{one.upper()}")
                  for one in (what, "constraint"))
    return bool(model.opt.disableflags & (bit | every * (what in ("equality", "limit"))))


def name_of(model: Any, kind: str, index: int) -> str:
    """Return the name of a thing of a model, of a kind such as "body"; else kind and index."""
    import mujoco

    named = mujoco.mj_id2name(model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), int(index))
    return named or f"{kind} {index}"


def _names(model: Any, kind: str, count: int, instead: Iterable[str] = ()) -> tuple[str, ...]:
    """Return a name for each of `count` things of a kind, nameless ones numbered where they recur.

    `instead` are names for those without, one for each; without it they are kind and index.
    """
    given = [getattr(model, kind)(i).name for i in range(count)]
    known = Counter(given)
    names = []
    for name, other in zip(given, instead or [f"{kind} {i}" for i in range(count)], strict=True):
        if not name:
            known[other] += 1
            name = other if known[other] == 1 else f"{other} {known[other]}"
        names.append(name)
    return tuple(names)


@dataclass(frozen=True)
class Part:
    """The robot in a compiled file.

    `bodies` and `joints` are indices, those of joints that move, in MuJoCo's order. All others stay
    at `held` (nq,) of MuJoCo. `on_base` says whether a free joint is put under the whole robot.
    `said` are sentences on what is left out.
    """

    compiled: Compiled
    bodies: frozenset[int]
    joints: tuple[int, ...]
    held: Array
    on_base: bool
    said: tuple[str, ...]


def part_of(file: Compiled, base: Base | None, locked: Mapping[str, ArrayLike],
            root: Sequence[str]) -> Part:
    """Choose the robot: everything from the bodies `root` on, or each tree that has joints.

    Without `root`, bodies that only float are left out if there is another tree with joints.
    Raises RobotError if no joint moves, or a body floats that is not the first to move;
    UnknownNameError for a name.
    """
    bodies, said = _from(file, root) if root else _scene(file)
    model, held = file.model, np.array(file.model.qpos0)
    joints = [j for j in range(model.njnt) if model.jnt_bodyid[j] in bodies]
    if not joints and base != "floating":
        moving = sorted({file.bodies[model.jnt_bodyid[j]] for j in range(model.njnt)})
        raise file.error("it has no joint that moves"
                         + (f" from {', '.join(root)} on; there are some on the bodies "
                            f"{', '.join(moving)}" if moving else ""))
    for name, value in locked.items():
        joints.remove(_lock(file, joints, held, name, value))
    if base == "fixed":
        joints = [j for j in joints if file.kind(j) != "free"]
    _check_floating(file, joints)
    floats = bool(joints) and file.kind(joints[0]) == "free"
    return Part(file, frozenset(bodies), tuple(joints), held,
                base == "floating" and not floats, said)


def _from(file: Compiled, root: Sequence[str]) -> tuple[set[int], tuple[str, ...]]:
    parents = file.model.body_parentid
    for name in root:
        check_name("body", name, file.bodies[1:])
    bodies = {file.bodies.index(name) for name in root}
    for body in range(1, file.model.nbody):  # parents come first
        if parents[body] in bodies:
            bodies.add(body)
    others = [file.bodies[top] for top, below in _trees(file).items() if not bodies & below]
    above = set[int]()
    for body in bodies:
        while (body := int(parents[body])) != WORLD:
            above.add(body)
    held = [name for j, name in enumerate(file.joints)
            if file.model.jnt_bodyid[j] in above - bodies]
    return bodies, tuple(each(("left out, since it is not under root", others),
                              ("held at the reference, since it is above root", held)))


def _scene(file: Compiled) -> tuple[set[int], tuple[str, ...]]:
    """Return all bodies, without those that only float beside a robot, and those of a mocap."""
    model, trees = file.model, _trees(file)
    moves = {top: [file.kind(j) for j in range(model.njnt) if model.jnt_bodyid[j] in below]
             for top, below in trees.items()}
    loose = [top for top, kinds in moves.items() if kinds == ["free"]]
    if len(loose) == sum(map(bool, moves.values())):
        loose = []
    mocap = [top for top in moves if model.body_mocapid[top] >= 0]
    targets = [top for top in mocap if not moves[top]]
    told = (("bodies that only float are left out (root = \"NAME\" takes one as the robot)", loose),
            ("mocap bodies are left out", targets),
            ("mocap bodies stay where the file has them", sorted({*mocap} - {*targets})))
    gone = [trees[top] for top in (*loose, *targets)]
    return set(range(model.nbody)).difference(*gone), tuple(
        each(*((what, [file.bodies[top] for top in tops]) for what, tops in told)))


def _trees(file: Compiled) -> dict[int, set[int]]:
    """Return the bodies of each tree by the one of them that is on the world."""
    tops = file.model.body_rootid
    return {int(top): set(np.flatnonzero(tops == top).tolist()) for top in np.unique(tops[1:])}


def _lock(file: Compiled, joints: Sequence[int], held: Array, name: str,
          value: ArrayLike) -> int:
    """Set the value of the joint `name`, one of `joints`, in `held` (nq,); return the joint."""
    names = [file.joints[j] for j in joints]
    check_name("joint", name, names)
    j = joints[names.index(name)]
    places = file.places(j)
    q, single = np.zeros(len(places)), len(places) % 4  # then, of the others, a quaternion
    own = [JointPart(j, i, 0, 1) for i in range(single)] + [
        JointPart(j, single, 0, 4)] * (len(places) // 4)
    with naming(f"robot file {file.file!r}: locked", RobotError):
        set_joint(own, q, j, name, value)
    held[places] = q
    return j


def _check_floating(file: Compiled, joints: Sequence[int]) -> None:
    """Raise RobotError if another joint than the first is free: a robot floats as a whole."""
    model = file.model
    for j in joints[1:]:
        if file.kind(j) == "free":
            trees = [file.bodies[top] for top in dict.fromkeys(
                int(model.body_rootid[model.jnt_bodyid[i]]) for i in joints)]
            raise file.error(
                f"body {file.bodies[model.jnt_bodyid[j]]!r} floats, and is not the first body with "
                "joints; only one robot can float. Choose with root = one of "
                f"{', '.join(trees)}, or hold it with base = \"fixed\"")
