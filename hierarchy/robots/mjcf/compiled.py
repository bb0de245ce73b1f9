"""An MJCF as MuJoCo compiles it, with a name for everything in it."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hierarchy.errors import RobotError

KINDS = ("free", "ball", "slide", "hinge")  # as MuJoCo numbers the types of joints
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
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        try:
            model = _compiled(mujoco.MjSpec.from_file(file))
        except ValueError as error:
            said = _in_one_line(str(error))
            raise RobotError(f"robot file {file!r} cannot be read: {said}") from error
    missing = tuple(dict.fromkeys(f"MuJoCo warns: {_in_one_line(str(one.message))}"
                                  for one in warned))
    bodies = _names(model, "body", model.nbody)
    of_body = [f"{bodies[body]} {KINDS[kind]}"
               for body, kind in zip(model.jnt_bodyid, model.jnt_type, strict=True)]
    return Compiled(file, model, _names(model, "joint", model.njnt, of_body), bodies,
                    _names(model, "site", model.nsite), _names(model, "key", model.nkey), missing)


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
