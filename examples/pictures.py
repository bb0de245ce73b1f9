"""Draw the pictures of the examples: python examples/pictures.py [NAME ...]

Blue is the robot with strict levels, red the other way at the tick in which that is worst; beside
them what the example measures, over time.
"""

import importlib
import io
import sys
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.collections import PatchCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from PIL import Image

from hierarchy import Robot, State
from hierarchy.avoidance import Obstacles
from scenarios import load, simulate
from scenarios.cell.sensors.sensor import make_obstacles
from scenarios.draw.figures.drawing import ALERT, INK, present, project
from scenarios.draw.figures.picture import outline
from scenarios.recording.facts import capsules, ends

HERE = Path(__file__).parent
OUT = HERE.parent / "docs" / "images" / "examples"
BLUE = "#2f5d9b"
EQUAL = ["control.resolver=weighted", "control.options.ratio=1", "control.damping=0"]
# What is measured, the two ways, the frame whose path is drawn, azimuth [deg] of the view.
VIEWS = {
    "ur5": ("arm to the ball, 50 asked [mm]", ("strict levels", "equal weights"), "tool0", 60.0),
    "panda": ("tilt of the glass [deg]", ("strict", "one level"), "panda_hand_tcp", 60.0),
    "iiwa": ("tool moves by [mm]", ("strict", "weights 10:1"), "iiwa_joint_4", 10.0),
    "so101": ("tip off its circle [mm]", ("strict", "one level"), "gripper_frame", 60.0),
    "mobile": ("hand off the wall [mm]", ("strict", "weights 10:1"), "tool0", 150.0),
    "tray": ("hands apart by [mm]", ("strict levels", "equal weights"), "right_hand", -30.0),
    "quadruped": ("foot slides by [mm]", ("strict", "weights 10:1"), "head", 40.0),
    "humanoid": ("foot slides by [mm]", ("strict", "one level"), "left_hand", -60.0),
    "teleop": ("joint acceleration [rad/s²]", ("limits", "without"), "panda_hand_tcp", 30.0),
    "policy": ("tool off the seam [mm]", ("strict", "policy alone"), "panda_hand_tcp", 30.0),
    "retarget": ("standing foot slides by [mm]", ("strict", "one level"), "left_foot", -60.0),
    "wall": ("elbow beyond the wall [mm]", ("strict", "without"), "iiwa_joint_4", 10.0)}


def runs(name, ways):
    """Return the robot and, for each way, its positions, what was measured and the times."""
    if name in ("ur5", "tray"):
        return _of_scenario(name)
    example = importlib.import_module(name)
    found = []
    for way in ways:
        qs, measured = example.run(way, example.main.__defaults__[0])
        found.append((qs, measured, example.DT * np.arange(len(qs))))
    return example.ROBOT, found, None


def _of_scenario(name):
    found = []
    for changes in ([], EQUAL):
        run = simulate(load(HERE / f"{name}.toml", changes))
        if name == "ur5":
            measured = 1e3 * np.minimum(run["minimal_distance"], run["ee_distance"])
        else:
            measured = 1e3 * np.linalg.norm(run["task_error_grip"][:, :3], axis=1)
        found.append((run["q"], measured, run["t"]))
    scenario = run.scenario
    robot = Robot.load(HERE / scenario.robot.model if name == "ur5" else scenario.robot.model)
    obstacles = make_obstacles(scenario.avoidance.placed) if scenario.avoidance else None
    return robot, found, obstacles


def draw(name):
    """Return the picture of an example."""
    label, ways, frame, azimuth = VIEWS[name]
    robot, ((qs, strict, t), (others, other, _)), obstacles = runs(name, ways)
    most = np.min if name == "ur5" else np.max
    worst = int(np.argmax(other == most(other)))
    fig = Figure(figsize=(7.2, 3.4), layout="constrained")
    fig.suptitle(title_of(name), x=0.01, ha="left", fontsize=10)
    ax, curves = fig.subplots(1, 2, width_ratios=(1.25, 1.0))
    for k in np.linspace(0, len(qs) - 1, 5).astype(int):
        _body(ax, robot, qs[k], azimuth, BLUE, 0.15)
    _body(ax, robot, others[worst], azimuth, ALERT, 0.5)
    _body(ax, robot, qs[worst], azimuth, BLUE, 0.9)
    _path(ax, robot, qs, frame, azimuth)
    if obstacles is not None:
        _ball(ax, obstacles, t[worst], azimuth)
    if name == "tray":
        for q, colour in ((others[worst], ALERT), (qs[worst], INK)):
            hands = [State.at(robot, q).position(f"{side}_hand") for side in ("left", "right")]
            ax.plot(*project(np.array(hands), azimuth, 12.0).T, color=colour, linewidth=4.0)
    if name == "wall":
        plane = np.array([[x, -0.05, z] for x, z in ((0, 0), (0.7, 0), (0.7, 1.1), (0, 1.1))])
        ax.add_patch(Polygon(project(plane, azimuth, 12.0), color=INK, alpha=0.15))
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.set_axis_off()
    for way, values, colour, above in zip(ways, (strict, other), (BLUE, ALERT), (3, 2),
                                          strict=True):
        curves.plot(t, values, color=colour, linewidth=1.4, zorder=above,
                    label=f"{way}: {_short(most(values))}")
    low, high = curves.get_ylim()
    curves.set_ylim(low, high + 0.2 * (high - low))  # room for the legend
    curves.set_title(label)
    if name in ("wall", "ur5"):
        curves.axhline(0.0 if name == "wall" else 50.0, color=INK, linewidth=0.6)
    curves.set_xlabel("s")
    curves.legend(loc="upper left", ncols=2)
    return fig


def title_of(name):
    """Return the first line of what an example says about itself."""
    python = (HERE / f"{name}.py").exists()
    text = (HERE / f"{name}.{'py' if python else 'toml'}").read_text(encoding="utf-8")
    return text.partition("\n")[0].lstrip('"# ')


def _short(value):
    return f"{value:.2f}" if abs(value) < 1.0 else f"{value:.3g}"


def _body(ax, robot, q, azimuth, colour, share):
    """Draw the capsules, the farthest first."""
    links = capsules(robot)
    segments = ends(links, State.at(robot, q).placements)
    a = np.radians(azimuth)
    order = np.argsort(segments.mean(axis=1) @ [np.cos(a), np.sin(a), 0.2])
    flat = project(segments, azimuth, 12.0)
    ax.add_collection(PatchCollection(
        [Polygon(outline(flat[i, 0], flat[i, 1], links[i].radius)) for i in order],
        facecolor=_mixed(colour, share), edgecolor="white", linewidth=0.5))


def _mixed(colour, share):
    return 1.0 - share * (1.0 - np.array(to_rgb(colour)))


def _path(ax, robot, qs, frame, azimuth):
    points = np.array([State.at(robot, q).position(frame) for q in qs[::5]])
    ax.plot(*project(points, azimuth, 12.0).T, color=INK, linewidth=0.9)


def _ball(ax, obstacles: Obstacles, t, azimuth):
    obstacles.at(float(t))
    centre = project(obstacles.centres[0], azimuth, 12.0)
    ax.add_patch(Circle(centre, obstacles.obstacles[0].size[0], color=ALERT, alpha=0.25))


def main(names):
    """Draw the named pictures, by default all."""
    OUT.mkdir(parents=True, exist_ok=True)
    for name in names or VIEWS:
        drawn = io.BytesIO()
        with matplotlib.rc_context(present().settings):
            draw(name).savefig(drawn, format="png", dpi=120, facecolor="white")
        with Image.open(drawn) as image:
            image.convert("RGB").quantize(128).save(OUT / f"{name}.png", optimize=True)
        print(OUT / f"{name}.png", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
