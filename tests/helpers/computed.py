"""What functions of the library return for fixed arguments, for tests/helpers/seen.py."""

import contextlib
import dataclasses
import importlib
import inspect
import itertools
import pkgutil
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from hand_made import recording
from mechanisms import four_bar
from rank_cases import CASES, boxed, build
from scene import FRAME, PATH, ROBOT, SENSOR, TASKS, state_at, states
from standing import CONTACTS, moving_state, opening, standing_stack, written
from standing import ROBOT as HUMANOID

import hierarchy
import scenarios
import solvers
from hierarchy import Hierarchy, HierarchyError, Robot, Stack, State, paths, tasks
from hierarchy.avoidance import Barrier
from hierarchy.task import Rows
from hierarchy.tasks.joints.joint_limits import StepLimits
from hierarchy.tasks.joints.mechanism import Mechanism, model_rows
from hierarchy.tasks.together import TangentCone
from scenarios.cell.published import PublishedAvoidance
from scenarios.measure.goals import goals
from scenarios.measure.metrics import measure
from scenarios.measure.runs import Run
from scenarios.measure.verdict import Comparison, goal_table, lines, verdicts
from solvers import Resolution, certify, explain, make, solve_ik
from solvers.adapters.displacements import Packed, Pull
from solvers.adapters.drop_in import answer
from solvers.batch import Batch, solve
from solvers.factorization import Factorization
from solvers.problems import ANY, generate, structured
from solvers.proof import prove
from solvers.qp.programs import level_problem
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled
from solvers.resolvers.weighted import lexicographic_weights

ROBOTS = Path(__file__).parents[1] / "data" / "robots"
BARRED = {f"{count} barred": tasks.Separation(SENSOR.points, Barrier(0.05), count)
          for count in (None, 3)}
TIMES, POINTS = (0.5, 1.2, 2.0, 3.5), ((0.0, 0.0, 0.1), (0.3, 0.1, 0.2), (0.3, 0.5, 0.0),
                                       (0.1, 0.2, 0.4))
PATHS = (paths.circle((0.1, 0.2, 0.3), 0.2, (0.2, -0.4, 1.0), 1.7, 0.4), PATH,
         paths.circle((0.1, 0.2, 0.3), 0.2, (1.0, 0.1, 0.0)), paths.Waypoints(TIMES, POINTS),
         paths.Recorded(TIMES, POINTS), paths.line(POINTS[0], POINTS[1], 1.5, 0.4),
         paths.Shifted(paths.Blended(TIMES, POINTS, 0.7), (0.1, 0.0, 0.2)),
         paths.Jittered(paths.Still(POINTS[3]), 0.01, 1.0, 3))


def rows():
    """Rows of tasks of an arm, of a humanoid in contact and of a mechanism, by name and level."""
    (q, v), found = states(1)[0], {}
    state, moving, bar = state_at(q, v), moving_state(3), four_bar(rigid=True)
    moving.t = 1.05  # a foot is coming down
    bent = State.at(bar, bar.integrate(bar.rest, 0.3 + 0.1 * np.arange(bar.n)), np.ones(bar.n))
    for level in ("velocity", "acceleration"):
        for name, task in (TASKS | BARRED).items():
            found[f"{name}, {level}"] = [
                written(task, state, level, 7), task.error(state), task.jacobian(state),
                task.jacobian_derivative(state), task.reference_velocity(state),
                task.reference_acceleration(state), task.desired_acceleration(state)]
        for task in model_rows(bar, 0.01):
            found[f"{task.name}, {level}"] = [  # rows that may have the other sign
                *map(np.abs, written(task, bent, level, bar.n)), task.row_names]
    for contacts in (CONTACTS, opening()):
        stiffness = 0.0 if contacts.contacts[1].open else 90.0
        for task in (tasks.Friction(contacts, 8, 2.0, 500.0), tasks.CentreOfPressure(contacts, .01),
                     tasks.LeastForce(contacts), tasks.BaseDynamics(contacts),
                     tasks.ContactForce(contacts, "left_foot", (10.0, 0.0, 99.0, 1.0, 2.0, 3.0)),
                     tasks.ContactMotion.at(moving, contacts, stiffness), tasks.Momentum("both"),
                     tasks.TorqueLimits(HUMANOID, 0.5, contacts=contacts)):
            n = contacts.unknowns if task.of_forces else HUMANOID.n
            found[f"{task.name} of {len(contacts.names)}"] = [
                written(task, moving, "torque" if task.of_forces else "acceleration", n),
                task.error(moving), getattr(task, "row_names", ())]
    return found


def mechanism():
    """How a four-bar is closed, how far open it is, and how it bends."""
    found = []
    for rigid, q in itertools.product((False, True), (0.1, 0.5)):
        bar = four_bar(rigid)
        one, start = Mechanism(bar), bar.integrate(bar.rest, np.full(bar.n, q))
        closed = one.closed(start, ("crank",))
        found.append([one.gap(start), closed, one.moving(closed, np.ones(bar.n)),
                      one.bend(closed, np.ones(bar.n), 0.01)])
    return found


def certificates():
    """Certificates of answers that are a little off, and proofs."""
    found = {}
    for seed in range(30):
        h = generate(seed, ANY)
        res = make("hcod").solve(h)
        for off in (0.0, 1e-2):
            x = res.x + off * np.sin(1.0 + np.arange(h.n))
            one = certify(h, x)
            off_by = dataclasses.asdict(one) if off else {}
            found[f"{seed} {off}"] = [
                repr(one), one._repr_html_(), one.level, one.certified, one.optimal, off_by,
                h.plain and Resolution(x, active=res.active).verified(h)]
        if seed < 9:
            found[f"{seed}"] = [repr(h), h._repr_html_(), repr(res), res._repr_html_()]
    problems = {name: boxed(build(name, True), -2.0, 1.5) for name in CASES}
    problems |= {f"turned {seed}": structured(seed) for seed in (211, 258, 285)}
    for name, h in problems.items():
        if h.n < 8 and h.m:
            one = prove(h, [make("hcod").solve(h).x])
            found[name] = dataclasses.asdict(one) | {"judged": one.judged, "turned": one.turn > 0.0}
    return found


def settled():
    """What comes to rest of levels within and out of reach, at limits, and what is asked for it."""
    found, eye = {}, np.eye(6)
    for seed in range(9):
        rng, size = np.random.default_rng(seed), 10.0 ** -(seed % 3)
        far = (2.0, 0.1, 1e-3)[seed // 3]
        U, V = (np.linalg.qr(rng.normal(size=(n, n)))[0] for n in (3, 6))
        V[:, 4] = 0.0  # a motor before a gear
        levels = {"limits": (eye, np.full(6, -1.5), np.full(6, 1.5)),
                  "gear": (eye[4:5] - 0.1 * eye[5:], [0.0]),
                  "hand": (size * U @ np.diag([1.0, 0.5, 0.1 ** (1 + seed % 7)]) @ V[:3],
                           far * size * rng.normal(size=3)),
                  "cone": (size * rng.normal(size=(3, 6)), far * size * np.array([-np.inf, 1, -5]),
                           far * size * np.array([-1.0, np.inf, 5.0])),
                  "height": (size * 0.1 * rng.normal(size=(1, 6)), [far * size]),
                  "posture": (eye, rng.normal(size=6))}
        for inner, left_out in (("hcod", ()), ("merged", ()), ("tpm", ("cone",)), (
                "recursive", ("limits", "cone"))):
            kept = {name: level for name, level in levels.items() if name not in left_out}
            h = Hierarchy.from_levels([*kept.values()], names=[*kept])
            for k, more in enumerate(({"curved": frozenset(["hand"])}, {
                    "curved": frozenset(["hand", "height"]), "bends": {"height": 2.0, "cone": 0.5},
                    "geared": True}, {"curved": frozenset(kept), "softness": 9.0})):
                resolver = Settled(inner=make(inner), period=0.1, **more)
                res = resolver.solve(h)
                again = resolver.solve(h, res.memory)
                active = res.active if seed else ()  # of the first, rounding says which act
                found[f"{seed} {inner} {k}"] = [res.x, res.status.name, active, again.x, [
                    part for A in resolver.asked(h).levels() for part in map(np.abs, A)]]
    return found


def judged():
    """Certificates of answers to degenerate problems, a little off, and proofs of some."""
    found = {}
    for seed in range(30):
        h = structured(seed)
        x = make("hcod").solve(h).x
        for off in (1e-9, 1e-6, 1e-4):
            one = certify(h, x + off * np.sin(seed + np.arange(h.n)) * (1.0 + np.abs(x)))
            found[f"{seed} {off}"] = [one.level, one.certified, one.violations, np.where(
                one.stationarity > 1e-9, one.stationarity, 0.0), max(one.nearest, 1e-9)]
        if h.n < 7 and h.m < 16:
            found[f"{seed}"] = dataclasses.asdict(prove(h, [x]))
    return found


def programs():
    """How `hqp` ends with each backend and form, and whether it has the answer of `hcod`."""
    found = {}
    for name, form, damping in itertools.product(
            ("proxqp", "osqp"), ("null-space", "slack"), (0.0, 0.05)):
        resolver = make("hqp", backend=name, form=form, damping=damping)
        for seed in range(8):
            h = generate(seed, ANY)
            res, exact = resolver.solve(h), make("hcod", damping=damping).solve(h).x
            found[f"{resolver.label} {damping} {seed}"] = [
                res.status.name, res.iterations, bool(np.abs(res.x - exact).max() < 1e-4)]
    return found


def derived():
    """Hierarchies that are made of others, and weights."""
    found = {"weights": [lexicographic_weights(V, 1e-2, r) for V, r in (
        ((0.1, 0.5, 2.0), 0.0), ((0.0, 1e-3, 5.0, 2.0), 0.3), ((), 0.0), ((0.2,), 1.0))]}
    for name in CASES:
        h = build(name, True)
        levels = [(A, b - 0.1, b + 0.2) for A, b, _ in h.levels()]
        h = Hierarchy.from_levels(levels, h.reference, give=[0.1 * i for i in range(len(levels))])
        res = make("hcod").solve(h)
        again = [make("hcod").solve(h, res.memory[:count]) for count in (None, -1)]
        found[f"{name} gives"] = [res.x, h.giving, str(explain(h, res)), *(
            [one.x, one.status.name, one.memory.size] for one in again), *(
            str(certify(h, x, witnesses=res.witnesses)) for x in (res.x, res.x + 0.01)), *(
            [*h.relaxed(level, res.x).rows] for level in range(len(levels)))]
        heavy, equal = h.changed(metric=np.diag(1.0 + np.arange(h.n))), build(name, True)
        found[f"{name} verified"] = [Resolution(make("hcod").solve(equal).x + off).verified(equal)
                                     for off in (0.0, 0.01)]
        found[f"{name} weighs"] = [make("hcod", damping=damping).solve(one).x
                                   for damping in (0.0, 0.05) for one in (h, heavy)]
    for name in ("generic", "middle_level_dependent_on_the_first", "levels_without_rows"):
        h = boxed(build(name, True), -0.5, 0.4)
        x = make("hcod").solve(h).x
        for level in range(len(h.sizes) + 1):
            one = level_problem(h, level, x)
            found[f"{name} {level}"] = [np.abs(part) for part in (
                one.P, one.q, one.G, one.h, one.A, one.b) if part is not None]
    return found


def adapted():
    """Levels out of tasks and limits as pink and mink give them, and what is said of wrong ones."""
    def asked(k, **more):
        J, e = CASES["generic"][k]
        return SimpleNamespace(**{"gain": 0.5, "compute_error": lambda _: e,
                                  "compute_jacobian": lambda _: J} | more)

    eye, found = np.eye(7), []
    box = ("Box", np.vstack([eye, -eye[:5]]), np.r_[0.01 * np.arange(1, 12), np.inf])
    plane = ("Plane", np.ones((1, 7)), np.array([0.02]))
    posture = asked(0, compute_error=lambda _: np.ones(7), compute_jacobian=lambda _: eye)
    for limits, above, entries, pull in (
            ([box, plane], [asked(1, gain=0.01)], [asked(0, cost=2.0, frame="arm"), posture], None),
            ([plane], [], [(asked(0, cost=np.array([1.0, 0.0, 3.0]), frame_name="hand"), asked(1)),
                           asked(2), asked(2)], None),
            ([], [], [(asked(0), asked(1)), posture], Pull(0.1, 0.2 * np.ones(7))),
            ([box], [asked(2, gain=0.01)], [asked(0, lm_damping=0.3), asked(1), asked(2, cost=0.0)],
             Pull(0.0, np.zeros(7))),
            ([box], [asked(0), asked(2)], [posture], None), ([], [], [asked(
                0, frame="arm", compute_error=lambda _: np.ones(6),
                compute_jacobian=lambda _: eye[:6])], None),
            ([box], [], [asked(0, lm_damping=0.3)], None), ([box], [], [SimpleNamespace()], None),
            ([box, ("Low", -eye[:1], np.array([-0.1]))], [], [posture], None),
            ([box], [], [asked(0, cost=[1.0, 2.0])], None), ([], [asked(0, gain=np.nan)], [], None),
            ([("Odd", eye[:, :3], np.ones(7))], [], [posture], None),
            ([("Odd", eye, np.full(7, np.nan))], [], [posture], None)):
        def pack(solve, given=(limits, above, entries, pull)):
            return Packed(None, lambda: list("abcdefg"), 7, 0.1, *given, solve=solve)

        try:
            h = pack(lambda h: make("hcod").solve(h).x).hierarchy()
            found.append([" ".join(h.names), " ".join(h.named()), *h.rows])
            found.append([answer("hcod", {}, 0.0, 1e-9, pack,
                                 lambda *said: HierarchyError(said[2]))])
        except HierarchyError as error:
            found.append(str(error))
    return found


def defaults():
    """Numbers and defaults of what each module calls public, and settings that are refused."""
    found, plain = {}, (int, float, str, tuple)
    for package in (hierarchy, solvers, scenarios):
        for _, name, _ in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if name.endswith(("__main__", "on_jax")):  # which ends here, and needs jax
                continue
            module = vars(importlib.import_module(name))
            found |= {f"{name} {key}": [repr(one)] for key, one in module.items() if key.isupper()
                      and isinstance(one, (int, float, tuple, np.ndarray))
                      and not re.search(r"^\D*$|<|Table\(", repr(one)) and ".jit." not in name}
            found |= {f"{name} {key}": [repr(one)] for key, one in module.items() if key.isupper()
                      and isinstance(one, dict) and re.search(r"[:(] ?-?\d", repr(one))
                      and not re.search(r"<|Table\(|Posed\(", repr(one))
                      and key != "BACKENDS"}  # which entrants of a benchmark replace
            public = [(f"{name} {key}", one) for key, one in module.items()
                      if key[0] != "_" and getattr(one, "__module__", "") == name
                      and not hasattr(one, "__members__")]
            methods = [(f"{key} {part}", getattr(what, "__func__", what)) for key, one in public
                       if isinstance(one, type) for part, what in vars(one).items()
                       if part[0] != "_"]
            for key, one in (*public, *methods):
                with contextlib.suppress(TypeError, ValueError):  # nothing that can be called
                    found[key] = [f"{given.kind.name} {of} = {given.default!r}"
                                  for of, given in inspect.signature(one).parameters.items()
                                  if isinstance(given.default, plain)]
    for name, value in itertools.product(solvers.names(), (-2, -1, 0, 1e-3, 1, 1e6, "none", None)):
        for field in dataclasses.fields(make(name)):
            try:
                make(name, **{field.name: value})
            except HierarchyError as error:
                found[f"{name} {field.name} {value}"] = [str(error)]
    return {key: given for key, given in found.items() if given}


def edited():
    """A factorization after edits, and what it refuses."""
    levels = [A for A, _ in CASES["middle_level_dependent_on_the_first"]]
    one = Factorization(levels, ["a", "b", "c"])
    found = []
    for edit, *arguments in (
            (one.swap, "a", 2), (one.reorder, [1, 0, 2]), (one.delete, "b"),
            (one.insert, "d", np.eye(6)[:2] + 0.1, 1), (one.insert, "e", levels[1])):
        edit(*arguments)
        b = np.cos(np.arange(one.m))
        found.append([one.names, one.sizes, one.ranks, one.n, one.F, one.G, one.rows,
                      one.coefficients @ one.basis.T, one.solve(b).x,
                      one.solve(b, np.ones(6)).x])
    return found


def solved():
    """Batches, inverse kinematics and configurations that serve tasks best."""
    problems = [Hierarchy.from_levels([(A + 0.01 * k, b) for A, b in CASES["generic"]])
                for k in range(3)]
    found = [dataclasses.asdict(solve(Batch.of(problems), make(name), threads=1))
             for name in ("tpm", "hcod", "merged")]
    q = np.array([0.9, -0.9, 0.9, 1.2, 1.0, 1.0, 0.3])
    for goal in ((0.3, 0.5, 0.1), (0.9, 0.0, 0.35), (0.0, 0.1, 5.0)):
        asked = [tasks.Position(FRAME, paths.Still(goal)), tasks.Posture(tuple(q), gain=2.0)]
        for settings in ({}, {"limits": False}, {"resolver": "tpm", "damping": 0.0},
                         {"limits": tasks.JointLimits(ROBOT, 9.0, 0.01), "v": 0.1 * np.ones(7)}):
            step = solve_ik(ROBOT, q, asked, **settings)
            found.append([step.v, step.status.name, repr(step), repr(step.memory)])
        reached = solve_ik(ROBOT, q, asked[:1], until=1e-6)
        found.append([reached.verdict, reached.met, reached.errors, reached.status.name,
                      reached.starts, reached.iterations if reached.met else (
                          reached.iterations >= reached.starts)])
    state = moving_state(5)
    stack = standing_stack(state, CONTACTS, (0.05, 0.0, 0.0), 0.8, 8)
    h = stack.hierarchy(state)
    heavy = Stack([TASKS["posture"]], "velocity", metric=np.diag(1.0 + np.arange(7.0)))
    res = make("hcod").solve(h)
    missed = [line.partition(":")[0] for line in str(explain(h, res)).splitlines()]
    return [*found, [*h.rows], res.x, missed, repr(state),
            heavy.hierarchy(state_at(q, q), ["posture"]).metric]


def odd():
    """What is said of, or done with, what is seldom given."""
    levels, found = CASES["generic"], {}
    for name, (of, bad) in itertools.product((*solvers.names(), "smooth"), (
            ("A", np.nan), ("A", 1e200), ("lower", np.inf), ("reference", np.nan))):
        h = Hierarchy.from_levels(levels)
        getattr(h, of).flat[0] = bad
        h.upper[0] = h.lower[0]
        res = make(name).solve(h)
        found[f"{name} {of} {bad}"] = [res.status.name, res.x]
    cone = TangentCone(TASKS["cone"])
    for k, (q, v) in enumerate(states(9)):
        state = state_at(q, v)
        found[f"cone {k}"] = [cone.reference_velocity(state), cone.jacobian(state)]
    (q, v), ball = states(1)[0], Robot.load(ROBOTS / "odd.xml")
    lagging, alone = state_at(q, v, differences=1e-3), make("tpm")
    wrong = PublishedAvoidance(ROBOT.control_points, 1)
    steps = StepLimits(ROBOT, 0.1)
    ellipse = scenarios.load("ellipse")
    runs = (Run(ellipse, "tpm", "tpm"), Run(ellipse, "sns", "sns", None, "broken"))
    for k, ask in enumerate((
            lambda: wrong.jacobian_derivative(lagging),
            lambda: wrong.jacobian_derivative(state_at(q, v)),
            lambda: [*steps.box(lagging), steps.error(lagging)], lambda: CONTACTS.forces(v),
            lambda: [SetBased(inner=alone).label], lambda: TangentCone(TASKS["pointing"]),
            lambda: cone.writer(state, "acceleration", Rows.empty(1, 7)),
            lambda: [cone.name, cone.kind, cone.dimension],
            lambda: str(Comparison(runs, "compare", {})), lambda: repr(ellipse),
            lambda: [*ball.position_limits(), ball.missing])):
        try:
            found[f"asked {k}"] = [ask()]
        except HierarchyError as error:
            found[f"asked {k}"] = [str(error)]
    return found


def measured():
    """Metrics and goals of runs whose signals come to each threshold and pass it."""
    found, steps = {"no tick": [goals(recording(t=[])), measure(recording(t=[]))]}, np.geomspace(
        1e-12, 1.0, 25)
    along = np.outer(steps, np.eye(7)[2])
    for name, sign in itertools.product(("ellipse", "ellipse-hqp", "singular"), (1.0, -1.0)):
        near = 0.05 - sign * steps
        run = recording(
            scenarios.load(name), t=0.5 * np.arange(25), status=np.arange(25) % 3,
            q=sign * (along + 2.0), v=sign * along, a=100.0 * along, command=1e3 * along,
            velocity_limit=np.full(7, 0.02), pointing_error=sign * steps, time_tick=steps,
            position_error=along[:, :3], desired_position=sign * along[:, :3], ee_distance=near,
            control_point_distance=near[:, None] + np.zeros(8), minimal_distance=near,
            active_control_point=np.arange(25) % 4)
        found[f"{name} {sign}"] = [*map(str, goals(run)), *(
            [key, one.value, one.note] for key, one in measure(run).items())]
        judged = verdicts([Run(run.scenario, of, of, one, None if one else "no")
                           for of, one in (("a", run), ("b", None))])
        found[f"{name} {sign} judged"] = [*map(str, [*goal_table(judged), *lines(judged)])]
    return found


COMPUTED = {"rows": rows, "derived": derived, "adapted": adapted, "defaults": defaults,
            "mechanism": mechanism, "certificates": certificates, "programs": programs,
            "settled": settled, "judged": judged,
            "edited": edited, "odd": odd, "solved": solved, "measured": measured,
            "paths": lambda: [[path(t) for t in np.linspace(-0.2, 4.4, 24)] for path in PATHS]}
