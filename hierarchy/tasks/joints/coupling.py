"""Couplings of joints: gears, mimic joints, fingers that close together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import zip_longest
from math import lcm, pi
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, expect, expect_each, number
from hierarchy.measured import Measure, Measured, measured
from hierarchy.paths.path import polynomial
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.robots.found import Coupled
from hierarchy.robots.joints import Part
from hierarchy.state import State


class Terms(NamedTuple):
    """Row i of a coupling is the sum of polynomials of joints, over the terms with `rows` i.

    For each term: its row, the index of the joint in q and in v, whether the joint is continuous,
    and coefficients (t, k), the constant first. `turns` (m,) is what a row may be off by without
    being missed, because joints have turned around [rad]; infinite where none is continuous.
    """

    rows: NDArray[np.int64]
    positions: NDArray[np.int64]
    velocities: NDArray[np.int64]
    continuous: NDArray[np.bool_]
    coefficients: Array
    turns: Array


class _Coupling(Measured):
    """Rows in which polynomials of joints add up to zero. Abstract: needs `terms`."""

    terms: Terms
    exact = True

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`; the error is to the nearest full turn of a continuous joint."""
        return _coupling, (state.q, self.terms)


@dataclass(frozen=True)
class JointCoupling(_Coupling):
    """Keep the sum of factor times position over `joints` at `value` (m = 1) [rad or m].

    `joints` has a factor for each joint by name: {"motor": 1.0, "wheel": -50.0} is a gear of ratio
    50. The position of a continuous joint is its angle; of two sums that differ by full turns of
    such joints the nearer one counts, if their factors are multiples of a twelfth of the least. Of
    a joint with several velocities only the turn of a planar one can be coupled, as "NAME 3".
    Raises HierarchyError for another, an unknown joint, or no factor.
    """

    robot: Robot
    joints: Mapping[str, float]
    value: Annotated[float, number] = 0.0
    stiffness: float = 100.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "coupling"
    straight = True

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"task {self.name!r}: joints", self.joints, Mapping, "give {name: factor, ...}")
        for name, factor in self.joints.items():
            number(f"task {self.name!r}: joints.{name}", factor)
        self.refuse(not any(self.joints.values()), f"joints {dict(self.joints)} have no factor "
                    "other than zero")
        constants = [-self.value, *[0.0] * (len(self.joints) - 1)]
        terms = [(0, name, (constant, factor)) for constant, (name, factor)
                 in zip(constants, self.joints.items(), strict=True)]
        set_frozen(self, terms=_terms(self.robot, 1, terms))

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joints."""
        return (" and ".join(self.joints),)


@dataclass(frozen=True)
class FollowedJoints(_Coupling):
    """Keep joints on polynomials of others, such as those of `Robot.coupled` (a row for each)."""

    robot: Robot
    coupled: tuple[Coupled, ...]
    stiffness: float = 100.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "couplings"

    def __post_init__(self) -> None:
        super().__post_init__()
        expect_each(f"task {self.name!r}: coupled", self.coupled, Coupled, "see Robot.coupled")
        self.refuse(not self.coupled, "no joints are coupled")
        terms: list[tuple[int, str, tuple[float, ...]]] = []
        for row, one in enumerate(self.coupled):
            constant, *others = one.coefficients
            terms.append((row, one.joint, (-constant, 1.0)))
            if one.other:
                terms.append((row, one.other, (0.0, *(-c for c in others))))
        set_frozen(self, terms=_terms(self.robot, len(self.coupled), terms))

    @property
    def straight(self) -> bool:  # type: ignore[override]
        """Whether no coupling is a polynomial that is no line."""
        return all(one.straight for one in self.coupled)

    @property
    def row_names(self) -> tuple[str, ...]:
        """The couplings."""
        return tuple(str(one) for one in self.coupled)


def _terms(robot: Robot, rows: int,
           terms: Sequence[tuple[int, str, tuple[float, ...]]]) -> Terms:
    """Return terms given by row, joint and coefficients; RobotError for several velocities."""
    found, factors = [], [list[float]() for _ in range(rows)]
    for row, name, coefficients in terms:
        part = _part(robot, name)
        slope, *bends = (*coefficients[1:], 0.0)
        if part.size == 2 and slope and not any(bends):
            factors[row].append(abs(slope))
        found.append((row, part.q, part.v, part.size == 2))
    rows_of, positions, velocities, continuous = np.array(found, dtype=np.int64).T.copy()
    padded = np.array(list(zip_longest(*(one for _, _, one in terms), fillvalue=0.0))).T
    turns = np.array([2.0 * pi * _part_of(own) if own else np.inf for own in factors])
    return Terms(rows_of, positions, velocities, continuous.astype(np.bool_), padded.copy(), turns)


_LARGEST = 12   # denominator of the ratio of two factors
_OFF = 1e-3     # of a ratio, as files round it


def _part_of(factors: Sequence[float]) -> float:
    """Return the largest number of which all factors are multiples; else the least of them.

    At a factor of 1.5 beside one of 1, a turn of either is a multiple of half a turn.
    """
    least = min(factors)
    ratios = [Fraction(factor / least).limit_denominator(_LARGEST) for factor in factors]
    common = all(abs(ratio - factor / least) <= _OFF
                 for ratio, factor in zip(ratios, factors, strict=True))
    return least / lcm(*(ratio.denominator for ratio in ratios)) if common else least


def _part(robot: Robot, name: str) -> Part:
    """Return the part of a joint with one velocity, or that is the turn `name` of a planar one."""
    turns = {robot.velocity_names[part.v]: part for part in robot.parts if part.size == 2}
    if name in turns:
        return turns[name]
    own = [part for part in robot.parts if part.joint == robot.joint(name)]
    if [part.size for part in own] == [1]:
        return own[0]
    turn = [f", but for its turn {other!r}" for other, part in turns.items() if part in own]
    raise HierarchyError(f"robot {robot.name!r}: joint {name!r} has "
                         f"{sum(part.velocities for part in own)} velocities and cannot be "
                         f"coupled{''.join(turn)}")


@measured
def _coupling(kinematics, reads, goal, J, motion):
    q, terms = reads
    v, error = kinematics.v, motion.error
    for t in range(len(terms.rows)):
        i, of = terms.rows[t], terms.velocities[t]
        at = terms.positions[t]
        x = np.arctan2(q[at + 1], q[at]) if terms.continuous[t] else q[at]
        value, slope, bend = polynomial(terms.coefficients[t], x)
        J[i, of] += slope
        error[i] -= value
        motion.rate[i] += slope * v[of]
        motion.drift[i] += bend * v[of] * v[of]
    for i in range(len(error)):
        if terms.turns[i] < np.inf:
            error[i] -= terms.turns[i] * np.round(error[i] / terms.turns[i])
