"""Of recordings by hand: goals, statistics, causes, texts, for tests/helpers/seen.py."""

from dataclasses import astuple, replace
from types import SimpleNamespace
from unittest.mock import Mock, patch

import numpy as np
import pinocchio as pin
from hand_made import ROBOT, asked, recording

from hierarchy import Hierarchy, HierarchyError, State
from hierarchy.avoidance import Obstacle, Obstacles
from hierarchy.notebook import html_table
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.cell.plants import torque
from scenarios.cell.sensors.camera import DepthCamera, Pinhole
from scenarios.config.distributions import Distribution, flat
from scenarios.config.resolvers import default_resolvers
from scenarios.config.sections.sensor import CameraSection
from scenarios.config.validation import _table
from scenarios.draw.figures import drawing, letter
from scenarios.export import foxglove
from scenarios.loop.audit import ActiveSets
from scenarios.loop.controller import Controller
from scenarios.loop.footing import footing
from scenarios.measure import safety
from scenarios.measure.causes import Tick, causes
from scenarios.measure.goals import Goal, goals, percent
from scenarios.measure.happenings import happened
from scenarios.measure.metrics import Metric, as_plain_data, measure
from scenarios.measure.motions import motions, partings
from scenarios.measure.runs import Run, table
from scenarios.measure.statistics import best, paired, wilson
from scenarios.measure.verdict import Verdict, lines, verdicts
from scenarios.problems import recorded
from scenarios.recording import listed
from scenarios.recording.facts import _plain
from scenarios.recording.fate import levels_at, row_units
from scenarios.results import page, sampled_page
from scenarios.results.columns import Results, verdict
from scenarios.results.plan import Job
from scenarios.scene.drawn import scene
from solvers import Resolution, Status, make
from solvers.qp import backends


def signals():
    """Goals and metrics of five ticks with some signals."""
    def at(x):  # errors of position along one axis [mm], as the signals of a path at rest
        desired = np.outer(1e-3 * np.asarray(x, float), (1.0, 0.0, 0.0))
        return {"desired_position": desired, "position_error": desired}

    far, path = load("ellipse-hqp", {"avoidance.distance": 0.2, "avoidance.influence": 0.3}), [
        SimpleNamespace(path=SimpleNamespace(out_of_reach=spans)) for spans in (
            ((1.0, 2.0), (3.0, 3.5)), ((1.0, 2.0),), ((3.0, 4.0),))]
    step = {"v": np.diag([0, 0, 0, 0, 1.0, 0, 0])[:5],
            "a": np.outer([0.0, 1.0, 3.0, 3.0, 3.0], np.eye(7)[2]), **at([0, 1e3, 1.5e3, 2e3, 3e3])}
    limited, speed = np.full(7, 3.0), np.diag([0, 0, 4.0, 0, 0, 0, 0])[:5]
    moved = [measure(recording(asked(position=one), **step)) for one in path]
    return [[*map(astuple, one.values())] for one in moved] + [
        [*map(astuple, goals(run)), *map(astuple, measure(run).values())] for run in (
        *(recording(**at(x)) for x in ([90, 0, 0.5, 4, 3], [0.25, 0.5, 0.25, 0.25, 1.0],
                                       [90, 1.0, 0.5, 0.25, 0.5], [437] * 5)),
        # It came back; after more; and out again; it stayed; it left on both sides.
        *(recording(q=np.outer(q, np.eye(7)[0])) for q in (
            [0.0] * 5, [2.5, 2.2, 1.9, 1.9, 1.9], [2.5, 2.7, 1.9, 1.9, 1.9],
            [2.5, 1.9, 2.1, 1.9, 1.9], [2.5, 2.4, 2.4, 2.4, 2.4], [0.0, 2.3, -2.1, 0.0, 0.0])),
        recording(pointing_error=0.5 - np.cos(np.radians([60.0, 58.0, 76.0, 60.0, 60.0]))),
        *(recording(v=v, velocity_limit=limited) for v in (speed, 0.750125 * speed)),
        recording(contact_depth=[0, 2e-3, 0, 0, 0], contacts=np.zeros(5),
                  contact_force=np.zeros(5)),
        recording(a=np.full((5, 2), np.nan), fault="diverged at tick 5"),
        # Distances are judged by the true ones where a sensor measured others.
        recording(far, minimal_distance=[1, 0.05, 1, 1, 1], ee_distance=[1, 1, 1, 0.02, 1],
                  true_minimal_distance=[1, 0.4, 0.3, 1, 1], true_ee_distance=[1, 1, 0.35, 1, 1]),
        recording(far, minimal_distance=np.zeros(5), ee_distance=np.zeros(5),
                  true_minimal_distance=[0.2, 0.19995, 0.1998, 0.1, 1.0],  # 0.05 mm is rounding
                  true_ee_distance=[0.2, 0.4, 0.1, 0.4, np.nan]))]


def told():
    """Texts of verdicts, numbers and files."""
    hand = Goal("hand", "", "m", False, 1e-3, 0.02, 0.02, 0.5, 0.0, 0.0)
    short = load("ellipse", {"control.period": 0.3, "control.duration": 1.0})
    steps = [np.outer(np.arange(5) > 2, by * np.eye(7)[3]) for by in (50.0 * (1.0 + 1e-14), 50.1)]
    listed_ = [SimpleNamespace(kind="position", title=title) for title in ("hand", "elbow")]
    errors = [(one, "m", np.array(x)) for one, x in zip(listed_, (  # 1e-9 counts, what is less not
        [0.0, 9e-10, 1e-12, 5e-10, 9e-10], [0.0, 0.0, 0.0, 0.0, 1e-9]), strict=True)]
    with patch.object(listed, "errors", lambda run: errors):
        of_listed = measure(recording(asked(tasks=tuple(listed_))))
    return {
        "shares": [percent(share) for share in (0.5, 0.994, 0.9951, 0.99999, 1.0)],
        "units": lines([Verdict(unit, 1.0, 1.0, None, False, (replace(hand, unit=unit),))
                        for unit in ("m", "deg")]),  # which are not weighed against each other
        "end": [one.end for one in verdicts([Run(short, "a", "a", recording(
            short, t=[0.0, 0.3, 0.6]))])],
        "decimals": [Metric("", "", value, unit).shown() for value, unit in (
            *((12.3456789, unit) for unit in ("m", "s", "deg", "share", "rad", "rad/s", "rad/s^2",
                                              "rad/s^3", "N", "")),
            *((value, "rad") for value in (0.0123, 0.00649, 0.0004, 1e3, 1e5)),
            *((value, "") for value in (0.0, 0.25, 1.5, 3.0, 12.5, 4e-3, 0.01, 10.0)))],
        "file": [str(as_plain_data(recording(a=np.full((5, 2), np.nan), fault="diverged")))],
        "steps": [[len([*happened(run)]), measure(run)["acceleration_step_ticks"].value]
                  for run in (recording(command=by, a=by) for by in steps)],
        "listed": [[one.label, one.value] for key, one in of_listed.items() if key[:4] == "task"],
        "readers": [str(listed._error_reader(one, None)()) for one in (SimpleNamespace(
            error_reader=lambda state: lambda: 3.0), SimpleNamespace())]}


def statistics():
    """Pairs, the best of several, the interval of a share (Wilson 1927: 18 of 24)."""
    low, normal = np.linspace(1.0, 1.5, 16), np.random.default_rng(2).normal(size=(2, 16))
    # One pair of 8 against the trend: p = 0.016 alone, too much for ten rivals after Holm.
    apart = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -0.5])
    holes, first = np.where(np.arange(16) < 3, np.nan, 0.0), np.array([1.0, 2, 3, 4, np.nan, 6])
    columns = ([low, low + 1.0, low * (1.0 + 1e-10), low + 2.0], [low, low.copy()], [low],
               [normal[0], normal[0] + normal[1], normal[0] + 5.0], [low, np.full(16, np.nan)],
               [low, low + np.r_[np.full(12, 1.0), np.full(4, -50.0)]], [np.zeros(8), apart],
               [low * (1.0 + 1e-12), low + 1.0, low], [1e-12 * low, 2e-12 * low],
               [low, np.where(low < 1.2, low + 1.0, low)], [low, low + 1.0 + holes],
               [low + holes, low + 1.0], [low, low + 1.0, low + holes],
               [np.full(16, 2.0), np.repeat([2.0, 3.0], [9, 7])],
               [np.repeat([2.0, 3.0], [9, 7]), np.full(16, 2.0)],  # the medians are equal
               [np.zeros(8), *(apart * (1.0 + 0.01 * i) for i in range(10))])
    pairs = [paired(*both) for both in (
        (first, np.array([1.0, 1.0, 5.0, 4.0 * (1 + 1e-4), 5.0, np.inf])),
        (np.zeros(5), np.ones(5)), (np.zeros(6), np.arange(1.0, 7.0)),
        (np.full(3, np.nan), np.ones(3)), (np.zeros(9), np.full(9, 1e-10)),  # rounding
        (np.zeros(50), np.r_[np.full(26, -1.0), np.full(24, 2.0)]))]  # more are lower, by less
    pairs += [replace(pairs[0], p=p, higher=2, ranks=0.1) for p in (0.0499, 0.05)]
    return {"best": [str([best({i: sign * x for i, x in enumerate(one)}, lower_is_better=lower)
                          for sign in (1.0, -1.0) for lower in (True, False)]) for one in columns],
            "pairs": [[str(one), one.distinguishable, *astuple(one)] for one in pairs],
            "shares": [wilson(*one) for one in ((18, 24), (0, 10), (5, 10), (81, 263), (0, 0))]}


def answers():
    """Why an answer to a box, a task and a last level changed from one tick to the next."""
    def answer(h):
        return make("hcod").solve(h).x

    def tick(upper, row, target, reference=(0.0, 0.0), names=("box", "task", "rest")):
        h = Hierarchy.from_levels([(np.eye(2), [-1.0, -1.0], upper), ([row], [target]),
                                   (np.zeros((1, 2)), [0.0])], reference, names)
        return Tick(h, answer(h), np.hstack([np.eye(2), np.zeros((2, 1))]))

    wide, one, met = (1.0, 1.0), tick((1.0, 1.0), (1, 0), 3.0), tick((1.0, 1.0), (1, 0), 0.5)
    return [[f"{kind}: {text}" for kind, text in causes(*both, answer)] for both in (
        (tick(wide, (1.0, -1e-6), 10.0), tick(wide, (1.0, 1e-6), 10.0)),  # which end of x2
        (one, tick((2.0, 1.0), (1, 0), 3.0)),
        [tick(wide, (0.7, -1.0), by, (0.3, 0.7)) for by in (0.0, 3.0)],
        (tick(wide, (1, 0), 0.0), tick(wide, (1, 0), 0.0, (0.0, 0.5))),
        (one, tick(wide, (1, 0), 3.0, names=("box", "hand", "rest"))),
        (one, tick((np.inf, 1.0), (1, 0), 3.0)),
        (met, met._replace(x=np.array([-0.9, 0.0]))))]  # not what the resolver gives


def parted():
    """How far runs of strict resolvers are apart, where they part, and why."""
    def run(spec, by=0.0, tick=1, units=("rad",) * 7, **changed):
        scenario, q = asked(spec), np.zeros((5, 7))
        q[tick:, 2] = by
        one = recording(scenario, q=q, **changed)
        robot = replace(one.facts.robot, velocity_units=units)
        return Run(scenario, spec, spec, replace(one, facts=replace(one.facts, robot=robot)))

    unsolved, slides = 3 * np.eye(5, dtype=int), (("m",) * 7, ("rad", *("m",) * 6))
    (one,) = motions([run("recursive"), run("hqp", 5e-6), run("hcod", 2e-6)])
    pairs = [(run("recursive"), other) for other in (
        run("hqp", 5e-7), run("hqp", 1e-3, 3), run("hqp", 1e-3, 3, status=unsolved[3]),
        run("hqp", 1e-3, 3, status=unsolved[4]), run("hqp", np.nan, 2),
        run("hqp", 1e-3, 3, order=np.array([0, 1, 0, 0, 0])))]
    pairs += [(run("recursive", units=units), run("hqp", 1e-3, 3, units)) for units in slides]
    return [[*one.labels, one.apart], *(
        [str(found), found.largest] for pair in pairs for found in partings(pair))]


def sampled():
    """Verdicts, shares and axes of samples, also of runs that stopped early."""
    def results(labels, reasons, **columns):
        jobs = tuple(Job("", "", "", sample=i, label=label) for label in labels
                     for i in range(len(reasons) // len(labels)))
        return Results(jobs, reasons, {name: Metric(name, name, 1.0, "rad/s") for name in columns},
                       columns)

    def speeds(values, by, stopped=0):
        return results("ab", (None,) * (2 * len(values) - stopped) + ("fell",) * stopped,
                       speed_max=np.r_[values, by * values])

    many, few = np.linspace(1.0, 2.0, 16), np.linspace(1.0, 2.0, 6)
    runs = [*(speeds(many, by, stopped) for by, stopped in (
        (1.0, 0), (1.0, 3), (np.nan, 16), (0.1, 0), (0.1, 3), (0.1, 16), (2.0, 3))),
        speeds(few, 2.0), results("ab", (None,) * 12, **dict.fromkeys(  # p = 0.031, but of two
            ("speed_max", "acceleration_max"), np.r_[few, 2.0 * few]))]
    kept = [results(["tpm"], (None, None, end), body_below_share=np.array([0.0, 0.5, 1.0]),
                    joint_limit_excess=np.full(3, np.nan)) for end in (None, "broke")]
    far = results("a", (None,) * 101, margin=np.append(np.linspace(-100.0, -99.0, 100), 50.0))
    near, ends = np.linspace(10.0, 11.0, 100), np.r_[np.zeros(20), np.ones(20)]
    axes = [np.append(near, beyond) for beyond in (12.0, 13.0, 30.0)]
    axes += [-axes[1], *(np.r_[-2.0 - by, ends, 3.0 + by] for by in (0.0, 0.01)),
             *(np.r_[np.full(99, 8.0), beyond] for beyond in (20.0, 25.0)),  # twice as large these
             np.full(9, -8.0), np.zeros(9)]
    unasked = {"control.options.rank_tolerance": Distribution(uniform=(1e-9, 2e-9))}
    moved = [load("human", [f"avoidance.variation={{seed={seed}, spread=0.1, timing=0.9}}"])
             for seed in range(3)]
    return {"drawn": [str(load("ellipse").drawn(0, 0, unasked))],
            "moved": [[one.path.times, one.path.points] for scenario in moved
                      for one in scenario.avoidance.placed],
            "verdicts": ["\n".join([*verdict(one), str(one.paired("speed_max", "b"))])
                         for one in runs], "kept": [str(one.shares()) for one in kept],
            "beyond": [text.get_text() for text in sampled_page._spread(
                far, far.metrics["margin"]).axes[0].texts],
            "axes": [sampled_page._limits([values]) for values in axes]}


def acting():
    """Numbers of the sets of rows that hold a task back."""
    def bounded(target):
        return Hierarchy.from_levels([(np.eye(2), -np.ones(2), np.ones(2)), (np.eye(2), target)],
                                     names=("box", "task"))

    found = {}
    for name in ("hcod", "tpm", "sns", "weighted"):
        sets = ActiveSets()
        found[name] = [sets.number(h, make(name).solve(h)) for h in map(bounded, (
            (0, 0.5), (2, 0.5), (3, 0.5), (-2, 0.5), (-2, 5), (0.2, 0.1)))]
    sets, h, hcod = ActiveSets(), bounded((2.0, 0.5)), make("hcod")
    more, res = Hierarchy.from_levels([([[0.0, 1.0]], [0.5]), *h.levels()],
                                      names=("more", *h.names)), hcod.solve(h)
    unsure = Resolution(res.x, Status.ITERATION_LIMIT, active=res.active)
    return found | {"ticks": [str(sets(k, SimpleNamespace(hierarchy=h, resolution=one)))
                              for k, one in enumerate((Resolution(np.zeros(2)), res, unsure))],
                    "a level more": [sets.number(more, hcod.solve(more))]}


def shown():
    """Tables, commands and replays of pages, units, frames."""
    def made(spec="tpm-published", fault=None, **signals):
        scenario = asked().with_resolver(spec)
        return Run(scenario, spec, spec, recording(scenario, fault, **signals))

    a, tasks = np.ones((5, 7)), [
        {"kind": "look-at", "frame": "tool", "target": [1.0, 0.0, 0.0]},
        {"kind": "pointing", "frame": "tool", "axis": [0.0, 0.0, 1.0], "alpha_d": 20.0}]
    tables = [[made(minimal_distance=np.full(5, 0.2)), made("hqp")],
              [made(a=1.005 * a), made("hqp", a=a), made("recursive", a=2.0 * a)],
              [made(fault="diverged at tick 5"), made("hqp", a=a), made("recursive", a=2.0 * a)],
              [replace(made(a=a), timing=recording(time_tick=np.full(5, 9e-6), a=2.0 * a))]]
    for units in (("rad", "m"), ("rad or m", "rad or m"), ("rad", "rad or m")):
        tables.append([made(), made()])
        for run, unit in zip(tables[-1], units, strict=True):
            vars(run)["metrics"] = {"excess": Metric("excess", "Beyond", 0.5, unit)}
    changed = load("ellipse", ["control.duration=0.5", "pointing.alpha_d=35"])
    with patch.object(page, "html", lambda *_, rate, **__: int(100 * rate) * "x"):
        replays = [page.replay("a", motions([made()]), most) for most in (3000, 2999, 1000, 100)]
    with patch.object(page, "html", Mock(side_effect=HierarchyError("no frames"))):
        replays.append(page.replay("a", motions([made()]), 3000))
    of_joints = [{"kind": "coupling", "joints": {"joint_1": 1.0, "joint_2": 1.0}},
                 {"kind": "posture"}]
    two, of_units = simulate(load("ellipse-hqp", {
        "control.duration": 0.002, "tasks": of_joints})), []
    for units in (("rad",) * 7, ("m",) * 7, (*("m",) * 6, "rad")):
        robot = replace(two.facts.robot, velocity_units=units)
        run = replace(two, facts=replace(two.facts, robot=robot))
        of_units += [str(levels_at(run, [0]).units), *(
            f"{section.title} {unit}" for section, unit, _ in listed.errors(run))]
    away = np.where(np.arange(5)[:, None] > 2, np.nan, np.zeros(7))
    resolvers = []
    for missing in ("", "daqp"):
        with patch.object(backends, "installed", lambda name, no=missing: name != no):
            resolvers.append(str(default_resolvers()))
    ax, around = drawing.figure(width=4.0, height=3.0)[1][0], []
    for pixels in ([[50, 40], [70, 50]], [[20, 40], [80, 44]], [[2, 3], [4, 5]],  # high, wide
                   [[190, 90], [199, 99]], [[-50, 0], [300, 300]]):  # in corners, beyond
        letter._show_around(ax, np.array(pixels, dtype=float), 10.0, (100, 200))
        around.append([*ax.get_xlim(), *ax.get_ylim()])
    levels = [levels_at(recording(orders=orders, order=order), [0, 1, 4]) for orders, order in (
        (("a", "a > b"), [0, 1, 1, 0, 0]), (("",), np.zeros(5, int)))]
    return {"tables": [[f"{row.label} {row.unit} {row.cells}" for row in table(runs)]
                       for runs in tables],
            "commands": [page.run_command(Run(one.with_resolver(of), of, of), "runs/a")
                         for one, of in ((changed, "hqp:backend=osqp"), (load("ellipse"), "hcod"))],
            "shapes": [*(str(foxglove.obstacle(0.0, 0, one, np.array(one.centre))) for one in (
                Obstacle("box", (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)), Obstacle("point", (1., 2., 3.)),
                Obstacle("capsule", (1.0, 2.0, 3.0), (0.05, 0.2)))), str(
                    foxglove._capsule(np.ones(3), np.ones(3), 0.5, foxglove._ARM))],
            "html": [html_table("<b>", ("a&b",), rows, best={(1, 0)}) for rows in (
                [("<i>",), (2,)], [(i,) for i in range(100)], [(i,) for i in range(30)])],
            "replays": replays, "units": [str(row_units(*given, {})) for given in (
                (load("ellipse-hqp", {"tasks": tasks, "pointing": None}), [
                    "look-at", "pointing", "position"]), *(
                    (load("wipe", {"tasks.0.target": [20.0] * n}), ["force"]) for n in (1, 3, 6)))],
            "units of joints": of_units, "settings": [repr(_plain(value)) for value in (
                1.5, None, (1, 2.0), np.inf, (1.0, np.inf), [1.0])],
            "frames": [scene(recording(q=away, order=np.zeros(5, int)), rate).ticks
                       for rate in (1.0, 1e15)],
            "levels": [[*one.names, one.fate] for one in levels],
            "around": around, "resolvers": resolvers, "flat": [str(flat(one)) for one in (
                3, {"a": {"b": {"around": 1}}})],
            "at a path": [str(_table({"a": 3, "b": [{"c": 1}]}, path)) for path in (
                ["b", 0], ["a"], ["a", "d"], ["b", 1], [])]}


def standing():
    """Which of runs of 5 s end at rest and upright, and how far a point is inside of corners."""
    def run(fault=None, pushes=(), **changes):
        t = np.arange(0.0, 5.0, 0.01)
        scenario = SimpleNamespace(control=SimpleNamespace(duration=5.0),
                                   plant=SimpleNamespace(pushes=pushes))
        made = type("Run", (dict,), {"ticks": t.size, "fault": fault, "true": dict.get,
                                     "scenario": scenario})
        return made({"t": t, "v": np.zeros((500, 2)), "q": np.zeros((500, 2)),
                     "com": np.tile([0.0, 0.0, 0.8], (500, 1)), "support_margin": np.full(500, 0.1),
                     "joint_lower": np.full(2, -1.0), "joint_upper": np.full(2, 1.0), **changes})

    def moving(tick):
        return {"v": 0.3 * np.eye(500, 2, -tick) + 0.3 * np.eye(500, 2, 1 - tick)}

    sunk, corners = np.tile([0.0, 0.0, 0.8], (500, 1)), np.array(
        [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.2), (0.0, 0.0)])
    sunk[1:, 2] = 0.7
    runs = [run(), run(**moving(100)), run(**moving(400)), run(com=sunk), run("it has fallen"),
            *(run(q=np.full((500, 2), q)) for q in (-1.1, -1.005, 1.005, 1.1)),
            run(support_margin=np.full(500, np.nan)),
            *(run(pushes=(SimpleNamespace(at=at, duration=0.25),)) for at in (2.75, 2.85))]
    return {"stands": [str(safety.standing(one)) for one in runs], "inside": [
        [torque.inside(corners[:count], np.array(at)) for count in (6, 2)]
        for at in ((0.5, 0.5), (0.9, 0.4), (1.2, 0.5), (0.0, 0.3))]}


def doubts():
    """What a first tick says of changed robots whose run may fall, or prove nothing."""
    def strong(robot):
        robot.effort_limit[robot.actuated:] *= 1000.0

    def without_limit(robot):
        robot.effort_limit[robot.velocity_names.index("left_knee")] = np.inf

    def thin(robot):
        robot.model.inertias[robot.joint("left_knee")] = pin.Inertia(
            3.0, np.zeros(3), np.diag([0.03, 0.01, 0.01]))

    def floats(robot):
        robot.model.gravity.linear = np.zeros(3)

    left, found = {"frame": "left_foot", "x": [-0.05, 0.16], "y": [-0.04, 0.04]}, []
    for change, of in ((without_limit, {}), (strong, {}), (thin, {}),
                       (floats, {"contacts": [left]})):
        cell = build(load("stand-push").with_changes(of))
        change(cell.robot)
        controller = Controller(cell)
        controller.command(0.0, cell.plant.q, cell.plant.v)
        found.append(["\n".join(footing(controller))])
    return found


def windows():
    """Which ticks of which runs become problems, and of runs that end before their window."""
    found = {}

    def of(name, ends, seed, count, make):
        asked = []

        def window(scenario, first, count):
            plant = scenario.plant
            asked.append(f"{scenario.control.period * first:.6g} {scenario.start.q} " + str([
                getattr(plant, key, None) for key in (
                    "stops", "joint_friction", "joint_damping", "armature")] + [
                        scenario.limits.horizon]))
            return [Hierarchy.from_levels(
                [(np.eye(3)[:1], [k]), (np.eye(3)[:2], [7.0, 7.0]), (np.eye(3)[2:], [1.0])],
                names=("a", recorded.LEFT_OUT, "b")) for k in range(count - (len(asked) in ends))]

        with patch.object(recorded, "window", window):
            made = make(name, seed, count)
        found[f"{name} {seed}"] = asked
        return made

    made = of("DYN60", (2,), 60, 12, recorded.fresh)
    for seed in (0, 3, 4):
        of("ellipse-limits", (2, 3) if seed == 3 else (), seed, 2, recorded.recorded)
    with patch.object(recorded, "uninterrupted", lambda *_, **__: None):
        try:
            recorded.recorded("ellipse-limits", 3, 2)
        except HierarchyError as error:
            found["none"] = [str(error)]
    return found | {"made": [[" ".join(one.h.names), one.proof.x, one.proof.complete, str(
        one.before and [k for k, other in enumerate(made) if one.before is other.h])]
                             for one in made]}


def images():
    """Sums over images of a wall, and of a ball before it, with one kind of error each; times."""
    errors = {"noise_floor": 0.0, "noise_growth": 0.0, "rounding": "step", "step": 0.0,
              "missing": 0.0, "missing_at_edges": 0.0, "outliers": 0.0}
    state, eye, found = State.at(ROBOT, ROBOT.rest), Pinhole(80, 60, 70.0, 65.0), {}
    ball, rate = Obstacle("sphere", (0.0, 0.0, 2.0), (0.5,)), {"rate": 30.0, "jitter": 0.02}
    for name, change in (("exact", {}), ("noise", {"noise_floor": 1e-3, "noise_growth": 2e-3}),
                         ("missing", {"missing": 0.1}), ("edges", {"missing_at_edges": 0.5}),
                         ("outliers", {"outliers": 0.3}), ("steps", {"step": 0.01}), (
                             "disparity", {"rounding": "disparity", "step": 2.85e-3})):
        section = CameraSection(kind="camera", backdrop=3.0, **errors | change)
        for of in ((), (ball,)):
            camera = DepthCamera(section, eye, Obstacles(of), ())
            taken = (camera.image(i, state)[0] for i in range(20))  # one array, written again
            found[f"{name} {len(of)}"] = [[float(one.sum()), np.count_nonzero(one != 3.0)]
                                          for one in taken]
    for seed in (3, 4):
        late = DepthCamera(CameraSection(kind="camera", seed=seed, **rate), eye, Obstacles(()), ())
        times = [late.time(i) for i in range(50)]
        found[f"times {seed}"] = [times, [late.newest(t - by) for t in times for by in (0.0, 1e-6)]]
    return found


COMPUTED = {"signals": signals, "told": told, "statistics": statistics, "causes": answers,
            "parted": parted, "sampled": sampled, "acting": acting, "shown": shown,
            "standing": standing, "doubts": doubts, "windows": windows, "images": images}
