"""The panels of the letter's figures, each one quantity of a run over time."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from hierarchy import plugins
from hierarchy.problem import Array
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, MEASURED
from scenarios.recording.listed import errors
from scenarios.recording.recording import Recording

Draw = Callable[[Axes, Recording, str], None]

_DASHED = (0, (4, 3))


@dataclass(frozen=True)
class Panel:
    """One quantity of a run over time: its title, the signal it needs, how it is drawn.

    A `signal` that ends in "_" stands for all signals with that prefix. `typeset` is the unit as
    matplotlib sets it, where that differs from plain text. `shows` says whether there is something
    to see of a recording that fits. A plugin adds one with `register("figures", NAME)(Panel(...))`.
    """

    name: str
    title: str
    unit: str
    signal: str
    draw: Draw
    explains: str = ""
    typeset: str = ""
    shows: Callable[[Recording], bool] = lambda recording: True

    @property
    def heading(self) -> str:
        """Title and unit for a figure."""
        return f"{self.title} [{self.typeset or self.unit}]"

    def fits(self, recording: Recording) -> bool:
        """Whether the recording has the signals of this panel."""
        known = (any(name.startswith(self.signal) for name in recording.signals)
                 if self.signal.endswith("_") else self.signal in recording)
        return known and recording.ticks > 1


def position_components(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw each component of the position error [mm], as figure 10 (a) does."""
    for i, (axis, error) in enumerate(zip("xyz", recording.path_error().T, strict=True)):
        drawing.curve(ax, recording["t"], 1e3 * error, **drawing.joint_line(i), linewidth=0.9,
                      label=axis)


def joints(ax: Axes, recording: Recording, colour: str, signal: str, width: float,
           named: bool = False) -> None:
    """Draw a signal of each joint, as figures 4 and 9 (b) do.

    Of more joints than there are colours, the fastest have one, and the others are grey. Those of a
    run above in the figure have theirs again: one legend is for both.
    """
    peaks = np.abs(recording["v"]).max(axis=0)
    fastest = np.sort(np.argsort(-peaks, kind="stable")[:len(drawing.JOINTS)]).tolist()
    values, names = recording.true(signal).T, recording.facts.robot.speed_names
    above = dict.fromkeys(str(line.get_label()) for other in ax.figure.axes for line in other.lines)
    if len(known := [names.index(name) for name in above if name in names]) == len(drawing.JOINTS):
        fastest = known
    for i in {*range(len(values))} - {*fastest}:
        drawing.curve(ax, recording["t"], values[i], color=MEASURED, linewidth=0.3)
    for k, i in enumerate(fastest):
        drawing.curve(ax, recording["t"], values[i], **drawing.joint_line(k), linewidth=width,
                      label=names[i] if named else None)


def distance(ax: Axes, recording: Recording, colour: str, signal: str) -> None:
    """Draw D_min [m] of the end effector, red while repelled, or D_minimal of the body: figure 5.

    The true one has the measured one behind it; where no other is known, it is the measured one.
    """
    t, measured, avoidance = recording["t"], recording[signal], recording.scenario.avoidance
    shown = recording.true(signal)
    if apart := shown is not measured:
        drawing.curve(ax, t, np.where(np.isfinite(measured), measured, np.nan), color=MEASURED,
                      linewidth=0.7, label="measured")
    drawing.curve(ax, t, shown, color=colour, label="true" if apart else None)
    tip = signal == "ee_distance"
    if tip:
        _in_red(ax, t, shown, recording["repulsion_active"])
    if avoidance is not None:
        for symbol, value in avoidance.thresholds["ee" if tip else "body"].items():
            ax.axhline(value, color=INK, linewidth=0.6, linestyle=_DASHED)
            ax.annotate(symbol, (1.0, value), xycoords=("axes fraction", "data"),
                        fontsize="small", va="bottom", ha="right", color=INK)
    if not tip:
        ax.set_ylim(bottom=0.0)


def active_point(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (b), above: the number of the control point whose avoidance is in the stack."""
    t, active = recording["t"], recording["active_control_point"]
    changes = np.concatenate(([0], np.flatnonzero(np.diff(active)) + 1, [len(active)]))
    for first, last in itertools.pairwise(changes):
        if active[first] > 0:
            ax.plot([t[first], t[min(last, len(t) - 1)]], [active[first]] * 2, color=colour,
                    linewidth=3.0, solid_capstyle="butt")
    points = recording["control_point_distance"].shape[1]
    ax.set_ylim(0.3, points + 0.7)
    ax.set_yticks(range(1, points + 1, 1 + points // 6))


def pointing_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 7: cos(alpha_d) - cos(alpha), in red while the task is in the stack."""
    t, error = recording["t"], recording.true("pointing_error")
    drawing.curve(ax, t, error, color=colour)
    _in_red(ax, t, error, recording["pointing_active"])
    ax.axhline(0.0, color=INK, linewidth=0.6, linestyle=_DASHED)


def position_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw the distance of the end effector from where it should be [mm], logarithmic."""
    drawing.curve(ax, recording["t"], np.maximum(1e3 * recording.off_path(), 1e-6), color=colour)
    drawing.make_logarithmic(ax, "y")


def task_errors(ax: Axes, recording: Recording, colour: str, unit: str = "m",
                scale: float = 1e3) -> None:
    """Draw the errors of listed tasks in a unit, lengths [mm] or angles [deg], logarithmic."""
    titles = [section.title for section in recording.scenario.tasks]
    for section, of, error in errors(recording):
        if of == unit:
            drawing.curve(ax, recording["t"], np.maximum(scale * error, 1e-6),
                          **drawing.joint_line(titles.index(section.title)), linewidth=0.9,
                          label=section.title)
    drawing.make_logarithmic(ax, "y")


def _has_errors(unit: str, recording: Recording) -> bool:
    return any(of == unit for _, of, _ in errors(recording))


PANELS = (
    Panel("joint-velocities", "Joint velocities", "rad/s", "v",
          partial(joints, signal="v", width=0.8, named=True),
          "Continuous at acceleration level, with jumps at velocity level."),
    Panel("joint-accelerations", "Joint accelerations", "rad/s²", "a",
          partial(joints, signal="a", width=0.6),
          "It jumps where the stack changes or a limit becomes active."),
    Panel("position-error", "Distance from the desired position", "mm, logarithmic",
          "position_error", position_error,
          "The shipped ellipses start off their path on purpose."),
    Panel("body-distance", "Body to the nearest obstacle", "m", "minimal_distance",
          partial(distance, signal="minimal_distance"),
          "Dashed: below ε₂ a lowest-priority task pushes away, below ε₁ the first; d_min is "
          "kept."),
    Panel("active-point", "Control point being pushed away", "number", "active_control_point",
          active_point, "The control point nearest to an obstacle, while within ε₂.",
          shows=lambda recording: bool((recording["active_control_point"] > 0).any())),
    Panel("ee-distance", "End effector to the nearest obstacle", "m", "ee_distance",
          partial(distance, signal="ee_distance"),
          "Dashed: below ε_ee, in red, the position task is pushed off its path; d_min is kept."),
    Panel("pointing-error", "Pointing error", "cos α_d − cos α", "pointing_error", pointing_error,
          "Above zero the axis is outside the cone; red while the task is in the stack.",
          r"$\cos\alpha_d - \cos\alpha$"),
    Panel("task-errors", "Errors of the tasks, lengths", "mm, logarithmic", "task_error_",
          task_errors, "Each task's own error, whatever its place in the stack.",
          shows=partial(_has_errors, "m")),
    Panel("task-angles", "Errors of the tasks, angles", "°, logarithmic", "task_error_",
          partial(task_errors, unit="deg", scale=1.0), shows=partial(_has_errors, "deg")),
)
for _panel in PANELS:
    plugins.register("figures", _panel.name, shipped=True)(_panel)
_COMPONENTS = Panel("position-components", "Position error of the end effector", "mm",
                    "position_error", position_components)
PANEL = {panel.name: panel for panel in (*PANELS, _COMPONENTS)}


def _in_red(ax: Axes, t: Array, y: Array, mask: Array) -> None:
    if mask.any():
        drawing.curve(ax, t, np.where(mask, y, np.nan), color=ALERT, linewidth=1.7,
                      label="task active")
