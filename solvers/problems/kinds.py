"""Structured hierarchies as robots produce them, on which solvers fail more often than on noise.

Random numbers rarely tie, repeat or cancel. An arm at a multiple of 90 degrees, a velocity box at
rest or a foot in a corner does all three at once. Each kind is one short function from a random
generator to levels; `structured` draws one kind.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hierarchy.errors import SEEDS, check_name, whole
from hierarchy.problem import Array, Hierarchy

Random = np.random.Generator
Level = tuple[Array, Array, Array]
Levels = list[Level]


def structured(seed: int, kinds: Sequence[str] = (), equalities_only: bool = False) -> Hierarchy:
    """Return the structured hierarchy of a seed, reproducibly.

    kinds : names from KINDS to draw from; all of them if empty.
    equalities_only : whether each row keeps only one side, as an equality.

    Raises UnknownNameError: a name not in KINDS.
    """
    for kind in kinds:
        check_name("kind of problem", kind, _MAKERS)
    rng = np.random.default_rng([whole("structured: seed", seed, largest=SEEDS), 1])
    chosen = str(rng.choice(list(kinds or _MAKERS)))
    levels = _MAKERS[chosen](rng)
    if equalities_only:
        levels = [equal(A, np.where(np.isfinite(low), low, np.where(np.isfinite(up), up, 0.0)))
                  for A, low, up in levels]
    n = levels[0][0].shape[1]
    reference = rng.integers(-1, 2, n).astype(float) if happens(rng, 0.3) else None
    return Hierarchy.from_levels(levels, reference)


def bounded(h: Hierarchy, seed: int) -> Hierarchy:
    """Return a hierarchy of equalities below a first level with a box, reproducibly.

    The box lies around the x that meets the first level best. That x may be on a side or beyond it,
    and sides may coincide or be missing; rows are reversed, repeated and scaled.
    """
    rng = np.random.default_rng([whole("bounded: seed", seed, largest=SEEDS), 2])
    end = int(h.offsets[1]) if len(h.sizes) else 0
    middle = np.linalg.lstsq(h.A[:end], h.lower[:end], rcond=1e-6)[0] if end else h.reference
    half = float(np.abs(middle).max()) or 1.0
    rows = rng.integers(0, h.n, int(rng.integers(1, h.n + 3)))
    share = rng.choice([0.0, 0.0, 0.5, 1.0, -0.2, np.inf], (2, len(rows)))
    share[1] = np.maximum(share[1], -share[0])
    lower, upper = middle[rows] - half * share[0], middle[rows] + half * share[1]
    size = rng.choice([1.0, 1.0, -1.0, 1e-3, 1e3, -0.7], len(rows))
    sides = np.sort(np.array([lower, upper]) * size, axis=0)
    box = np.eye(h.n)[rows] * size[:, None], sides[0], sides[1]
    return Hierarchy.from_levels([box, *h.levels()], h.reference)


def _singular_arm(rng: Random, digits: int = 12, noise: float = 0.0) -> Levels:
    """Random arms at multiples of 90 degrees; velocity box, position, orientation, posture."""
    n = int(rng.integers(2, 9))
    J = np.round(_jacobian(rng, n, planar=happens(rng, 0.3)), digits)
    if noise:
        J += noise * rng.normal(size=J.shape)
    targets = rng.choice([0.0, 0.0, 1.0, -1.0, 0.5], 6)
    levels = [equal(J[:3], targets[:3]), equal(J[3:], targets[3:]), _posture(rng, n)]
    if happens(rng, 0.3):
        levels = [equal(J, targets), _posture(rng, n)]
    return [_box_at_rest(rng, n), *levels] if happens(rng, 0.7) else levels


def _dusty_arm(rng: Random) -> Levels:
    """The same, with the rounding of cosines kept; rows of 1e-17 where nothing moves.

    Strictly, a row of dust with a nonzero target requires an x of 1e17.
    """
    return _singular_arm(rng, digits=30)


def _near_singular_arm(rng: Random) -> Levels:
    """Singular arms with noise of 1e-14 to 1e-3; in each entry of the Jacobian."""
    return _singular_arm(rng, noise=10.0**rng.uniform(-14.0, -3.0))


def _tied_box(rng: Random) -> Levels:
    """Limits of 0, and tasks into their corner; the limits are of velocities."""
    n = int(rng.integers(1, 8))
    tasks = [equal(_rows(rng, size, n), _few(rng, size)) for size in rng.integers(1, 4, 2)]
    return [_box_at_rest(rng, n), *tasks, _posture(rng, n)]


def _opposed(rng: Random) -> Levels:
    """Avoidance from two sides with too little room; and a box; in any order."""
    n = int(rng.integers(1, 8))
    A = _rows(rng, int(rng.integers(1, 4)), n)
    room = rng.choice([-0.1, 0.0, 0.1, 0.5], len(A))
    one, other = _at_least(A, room), _at_least(-A, room)
    box, task = _box_at_rest(rng, n), equal(_rows(rng, 2, n), _few(rng, 2))
    if happens(rng, 0.5):
        return [stacked(one, other, box), task, _posture(rng, n)]
    levels = [one, other, box, task]
    return [levels[i] for i in rng.permutation(4)]


def _contacts(rng: Random) -> Levels:
    """Forces of feet in friction pyramids; unilateral, bounded, balanced and minimal."""
    feet = int(rng.integers(1, 5))
    mu, n = float(rng.choice([0.0, 0.3, 0.5, 1.0])), 3 * feet
    pyramid = np.array([[1.0, 0, -mu], [-1.0, 0, -mu], [0, 1.0, -mu], [0, -1.0, -mu]])
    cone = np.kron(np.eye(feet), np.vstack([pyramid, [0, 0, -1.0]]))
    limits = (np.eye(n), np.full(n, -np.inf), np.tile([np.inf, np.inf, 100.0], feet))
    force = np.tile(np.eye(3), feet)
    places = rng.choice([-0.1, 0.0, 0.1], (feet, 2))
    moment = np.hstack([[[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]] for x, y in places])
    wrench = np.concatenate([rng.choice([0.0, 0.0, 20.0, 300.0], 2),
                             rng.choice([-50.0, 0.0, 100.0, 600.0], 1)])
    balance = [equal(force, wrench), equal(moment, np.zeros(3))]
    if happens(rng, 0.5):
        balance = [stacked(*balance)]
    inside = (cone, np.full(len(cone), -np.inf), np.zeros(len(cone)))
    return [stacked(inside, limits), *balance, equal(np.eye(n), np.zeros(n))]


def _nested(rng: Random) -> Levels:
    """Levels that repeat upper ones; equal, a subset or sums, with the same or new sides."""
    n = int(rng.integers(1, 9))
    levels = [_sided(rng, _rows(rng, int(rng.integers(1, 5)), n))]
    for _ in range(int(rng.integers(1, 7))):
        A, lower, upper = stacked(*levels)
        chosen = rng.permutation(len(A))[:int(rng.integers(1, len(A) + 1))]
        again = A[chosen], lower[chosen], upper[chosen]
        sums = rng.integers(-1, 2, (2, len(A))) @ A
        levels.append([again, _sided(rng, A[chosen]), _sided(rng, sums),
                       stacked(again, _sided(rng, _rows(rng, 2, n)))][rng.integers(4)])
    return levels


def _mixed_units(rng: Random) -> Levels:
    """Rows of norm 0.001, 1 and 1000 in one level."""
    levels = _around(rng, int(rng.integers(1, 8)), int(rng.integers(1, 5)))
    return _in_units(rng, levels, np.array([-3.0, 0.0, 3.0]))


def _scaled(rng: Random) -> Levels:
    """Integers, rows times 1e-5 to 1e5, columns times 0.001 to 1000."""
    levels = _integers(rng)
    by = 10.0**rng.choice(np.arange(-3.0, 4.0), levels[0][0].shape[1])
    return _in_units(rng, [(A * by, lower, upper) for A, lower, upper in levels],
                     np.arange(-5.0, 6.0))


def _in_units(rng: Random, levels: Levels, powers: Array) -> Levels:
    """Return the levels with each row and its sides times ten to one of these powers."""
    scales = (10.0**rng.choice(powers, len(level[0])) for level in levels)
    return [(A * by[:, None], lower * by, upper * by)
            for (A, lower, upper), by in zip(levels, scales, strict=True)]


def _integers(rng: Random) -> Levels:
    """Entries and sides from -2 to 2."""
    n = int(rng.integers(1, 6))
    return [_sided(rng, rng.integers(-2, 3, (size, n)).astype(float))
            for size in rng.integers(1, 7, int(rng.integers(1, 5)))]


def _chain(rng: Random) -> Levels:
    """Bounds on differences of neighbours; with fixed ends, and targets."""
    n = int(rng.integers(2, 13))
    step = float(rng.choice([0.0, 0.5, 1.0]))
    A = np.eye(n)[:-1] - np.eye(n)[1:]
    differences = (A, np.full(n - 1, -step), np.full(n - 1, step if step else 1.0))
    ends = equal(np.eye(n)[[0, -1]], rng.integers(-3, 4, 2).astype(float))
    levels = [differences, ends, _posture(rng, n)]
    return levels if happens(rng, 0.5) else [ends, differences, _posture(rng, n)]


def _signs(rng: Random) -> Levels:
    """All sides 0, 1 or -1; rows in any direction."""
    n = int(rng.integers(1, 10))
    return [_sided(rng, _rows(rng, size, n), wide=1)
            for size in rng.integers(1, 9, int(rng.integers(1, 6)))]


def _one_unknown(rng: Random) -> Levels:
    """One unknown, many rows that disagree."""
    return [_sided(rng, rng.choice([-2.0, -1.0, 0.0, 1.0, 3.0], (size, 1)))
            for size in rng.integers(1, 6, int(rng.integers(1, 7)))]


def _sixty_unknowns(rng: Random) -> Levels:
    """Limits, tasks and posture of 60 unknowns; tasks with sides of 0 and 1."""
    n = 60
    tasks = [_sided(rng, _rows(rng, size, n), wide=1)
             for size in rng.integers(3, 13, int(rng.integers(2, 7)))]
    return [_box_at_rest(rng, n), *tasks, _posture(rng, n)]


def _fifteen_levels(rng: Random) -> Levels:
    """Fifteen levels, most without freedom."""
    return _around(rng, int(rng.integers(4, 12)), 15)


def _near_ties(rng: Random) -> Levels:
    """Repeated rows whose sides differ by 1e-9; in lower levels."""
    levels = _around(rng, int(rng.integers(2, 8)), int(rng.integers(1, 4)))
    for _ in range(int(rng.integers(1, 4))):
        A, lower, upper = stacked(*levels)
        chosen = rng.permutation(len(A))[:int(rng.integers(1, len(A) + 1))]
        by = 1e-9 * rng.choice([-3.0, -1.0, 0.0, 1.0, 3.0], len(chosen))
        levels.append((A[chosen], lower[chosen] + by, upper[chosen] + by))
    return levels


def _nearly_parallel(rng: Random) -> Levels:
    """Rows at angles of 1e-9 to 1e-6 rad; repeated in their level or below."""
    levels = _around(rng, int(rng.integers(2, 8)), int(rng.integers(2, 5)))
    for k, level in enumerate(levels):
        A, lower, upper = levels[int(rng.integers(k + 1))]
        i, angle = int(rng.integers(len(A))), 10.0**rng.uniform(-9.0, -6.0)
        row = A[i:i + 1] + angle * _rows(rng, 1, A.shape[1]) * np.linalg.norm(A[i])
        by = float(rng.choice([0.0, 0.0, 0.3]))
        levels[k] = stacked(level, (row, lower[i:i + 1] + by, upper[i:i + 1] + by))
    return levels


def _tiny_rows(rng: Random) -> Levels:
    """Rows of norm 1e-14; below rows of norm 1, as in a Jacobian that should be zero."""
    levels = _around(rng, int(rng.integers(2, 8)), int(rng.integers(2, 5)))
    for k in range(1, len(levels)):
        A, lower, upper = levels[k]
        dust = np.where(rng.random(len(A)) < 0.4, 1e-14, 1.0)
        levels[k] = (A * dust[:, None], lower, upper)
    return levels


def _shifted(rng: Random) -> Levels:
    """Another kind with all unknowns shifted; one listed before, by the same vector."""
    kind = str(rng.choice(list(_MAKERS)[:list(_MAKERS).index("shifted")]))
    levels = _MAKERS[kind](rng)
    by = rng.normal(size=levels[0][0].shape[1]) * 10.0**rng.integers(-12, 3)
    return [(A, lower + A @ by, np.where(lower == upper, lower + A @ by, upper + A @ by))
            for A, lower, upper in levels]


def _jacobian(rng: Random, n: int, planar: bool) -> Array:
    """Return the Jacobian (6, n) of a chain of n joints at multiples of 90 degrees."""
    turns = np.pi / 2.0 * rng.integers(0, 4, n)
    twists = np.zeros(n) if planar else np.pi / 2.0 * rng.integers(-1, 2, n)
    lengths, offsets = rng.choice([0.0, 0.3, 0.4], (2, n))
    place, axes, points = np.eye(4), [], []
    for turn, twist, a, d in zip(turns, twists, lengths, offsets * (not planar), strict=True):
        axes.append(place[:3, 2])
        points.append(place[:3, 3])
        c, s, ct, st = np.cos(turn), np.sin(turn), np.cos(twist), np.sin(twist)
        place = place @ np.array([[c, -s * ct, s * st, a * c], [s, c * ct, -c * st, a * s],
                                  [0.0, st, ct, d], [0.0, 0.0, 0.0, 1.0]])
    arms = place[:3, 3] - np.array(points)
    return np.vstack([np.cross(np.array(axes), arms).T, np.array(axes).T])


def _around(rng: Random, n: int, count: int) -> Levels:
    """Return levels of random rows with small integer sides."""
    return [_sided(rng, _rows(rng, size, n)) for size in rng.integers(1, 5, count)]


def _rows(rng: Random, size: int, n: int) -> Array:
    """Return unit rows (size, n): random, along an axis, or along a sum of axes."""
    rows = [rng.normal(size=n), np.eye(n)[rng.integers(n)], rng.integers(-1, 2, n).astype(float)]
    made = np.array([rows[rng.integers(3)] if i == 0 else
                     (rng.normal(size=n), np.eye(n)[rng.integers(n)])[rng.integers(2)]
                     for i in range(size)]).reshape(size, n)
    length = np.linalg.norm(made, axis=1, keepdims=True)
    return np.asarray(made / np.where(length > 0.0, length, 1.0))


def _few(rng: Random, size: int) -> Array:
    return np.asarray(rng.choice([0.0, 0.0, 1.0, -1.0, 0.5], size))


def _sided(rng: Random, A: Array, wide: int = 2) -> Level:
    """Return rows with integer sides: equalities, one-sided or two-sided."""
    sides = np.sort(rng.integers(-wide, wide + 1, (2, len(A))).astype(float), axis=0)
    kind = rng.integers(4, size=len(A))
    lower = np.where(kind == 2, -np.inf, sides[0])
    return A, lower, np.where(kind == 3, np.inf, np.where(kind == 0, lower, sides[1]))


def _box_at_rest(rng: Random, n: int) -> Level:
    """Return joint bounds; joints at a limit can move in one direction or not at all."""
    upper = rng.choice([0.0, 0.5, 1.0, 1.0], n)
    lower = -rng.choice([0.0, 0.5, 1.0, 1.0], n)
    return np.eye(n), lower, upper


def _posture(rng: Random, n: int) -> Level:
    return equal(np.eye(n), rng.choice([0.0, 1.0]) * rng.integers(-2, 3, n).astype(float))


def equal(A: Array, b: Array) -> Level:
    """Return a level of equalities."""
    return A, b, b.copy()


def _at_least(A: Array, side: Array) -> Level:
    return A, side, np.full(len(A), np.inf)


def stacked(*levels: Level) -> Level:
    """Return the rows of levels as one level."""
    A, lower, upper = zip(*levels, strict=True)
    return np.vstack(A), np.concatenate(lower), np.concatenate(upper)


def happens(rng: Random, chance: float) -> bool:
    """Draw whether something of this chance happens."""
    return bool(rng.random() < chance)


_MAKERS: dict[str, Callable[[Random], Levels]] = {
    "singular_arm": _singular_arm, "dusty_arm": _dusty_arm, "tied_box": _tied_box,
    "opposed": _opposed, "contacts": _contacts, "nested": _nested, "mixed_units": _mixed_units,
    "integers": _integers, "chain": _chain, "signs": _signs, "one_unknown": _one_unknown,
    "sixty_unknowns": _sixty_unknowns, "fifteen_levels": _fifteen_levels,
    "near_ties": _near_ties, "nearly_parallel": _nearly_parallel, "tiny_rows": _tiny_rows,
    "shifted": _shifted, "near_singular_arm": _near_singular_arm, "scaled": _scaled}
_LINES = {name: str(make.__doc__).partition("\n")[0] for name, make in _MAKERS.items()}
TEXTS = {name: f"{line[0].lower()}{line[1:].rstrip('.').partition(';')[0]}"
         for name, line in _LINES.items()}
"""What each kind has, in short, by its name."""
KINDS = tuple(TEXTS)
"""The names that `structured` knows."""
