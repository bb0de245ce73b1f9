"""The panels of the letter's figures, each one quantity of a run over time."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from hierarchy import plugins
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, MEASURED, Array
from scenarios.recording.listed import errors
from scenarios.recording.recording import Recording

Draw = Callable[[Axes, "Recording", str], None]


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


def joint_velocities(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 4: every joint's velocity [rad/s]."""
    for joint, velocity in enumerate(recording["v"].T):
        drawing.curve(ax, recording["t"], velocity, **drawing.joint_line(joint), linewidth=0.8,
                      label=f"joint {joint + 1}")


def joint_accelerations(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 9 (b): every joint's acceleration [rad/s^2]."""
    for joint, acceleration in enumerate(recording["a"].T):
        drawing.curve(ax, recording["t"], acceleration, **drawing.joint_line(joint), linewidth=0.6)


def ee_distance(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (a): D_min of the end effector [m], with eps_ee; red while repelled."""
    t, distance = recording["t"], _distance(ax, recording, "ee_distance", colour)
    if "repulsion_active" in recording:
        _in_red(ax, t, distance, recording["repulsion_active"])
    avoidance = recording.scenario.avoidance
    for symbol, threshold in avoidance.tip_thresholds.items() if avoidance else ():
        _threshold(ax, t, threshold, symbol)


def active_point(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (b), above: the number of the control point whose avoidance is in the stack."""
    t, active = recording["t"], recording["active_control_point"]
    changes = np.concatenate(([0], np.flatnonzero(np.diff(active)) + 1, [len(active)]))
    for first, last in itertools.pairwise(changes):
        if active[first] > 0:
            ax.plot([t[first], t[min(last, len(t) - 1)]], [active[first]] * 2, color=colour,
                    linewidth=3.0, solid_capstyle="butt")
    points = recording["control_point_distance"].shape[1] \
        if "control_point_distance" in recording else max(int(active.max()), 1)
    ax.set_ylim(0.3, points + 0.7)
    ax.set_yticks(range(1, points + 1, 1 + points // 6))


def body_distance(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 5 (b), below: D_minimal of the body [m], with eps_1 and eps_2."""
    t = recording["t"]
    _distance(ax, recording, "minimal_distance", colour)
    avoidance = recording.scenario.avoidance
    for symbol, distance in avoidance.thresholds.items() if avoidance else ():
        _threshold(ax, t, distance, symbol)
    ax.set_ylim(bottom=0.0)


def pointing_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 7: cos(alpha_d) - cos(alpha), in red while the task is in the stack."""
    t, error = recording["t"], recording["pointing_error"]
    drawing.curve(ax, t, error, color=colour)
    if "pointing_active" in recording:
        _in_red(ax, t, error, recording["pointing_active"])
    ax.axhline(0.0, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))


def position_components(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw figure 10 (a): the end effector's position error along x, y and z [mm]."""
    for axis, error in enumerate(recording["position_error"].T):
        drawing.curve(ax, recording["t"], 1e3 * error, **drawing.joint_line(axis), linewidth=0.9,
                      label="xyz"[axis])


def position_error(ax: Axes, recording: Recording, colour: str) -> None:
    """Draw the distance of the end effector from where it should be [mm], logarithmic."""
    error = 1e3 * np.linalg.norm(recording["position_error"], axis=1)
    drawing.curve(ax, recording["t"], np.maximum(error, 1e-6), color=colour)
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
    Panel("joint-velocities", "Joint velocities", "rad/s", "v", joint_velocities,
          "Continuous at acceleration level, with jumps at velocity level."),
    Panel("joint-accelerations", "Joint accelerations", "rad/s²", "a", joint_accelerations,
          "It jumps where the stack changes."),
    Panel("position-error", "Distance from the desired position", "mm, logarithmic",
          "position_error", position_error,
          "The shipped ellipses start off their path on purpose."),
    Panel("body-distance", "Body to the nearest obstacle", "m", "minimal_distance", body_distance,
          "Dashed: below ε₂ a lowest-priority task pushes away, below ε₁ the first; d_min is "
          "kept."),
    Panel("active-point", "Control point being pushed away", "number", "active_control_point",
          active_point, "The control point nearest to an obstacle, while within ε₂.",
          shows=lambda recording: bool(recording["active_control_point"].any())),
    Panel("ee-distance", "End effector to the nearest obstacle", "m", "ee_distance", ee_distance,
          "Dashed: below ε_ee, in red, the position task is pushed off its path; d_min is kept."),
    Panel("pointing-error", "Pointing error", "cos α_d − cos α", "pointing_error", pointing_error,
          "Above zero the axis is outside the cone; red while the task is in the stack.",
          r"$\cos\alpha_d - \cos\alpha$"),
)
TASK_PANELS = (
    Panel("task-errors", "Errors of the tasks, lengths", "mm, logarithmic", "task_error_",
          task_errors, "Each task's own error, whatever its place in the stack.",
          shows=partial(_has_errors, "m")),
    Panel("task-angles", "Errors of the tasks, angles", "°, logarithmic", "task_error_",
          partial(task_errors, unit="deg", scale=1.0), shows=partial(_has_errors, "deg")),
)
for _panel in (*PANELS, *TASK_PANELS):
    plugins.register("figures", _panel.name, shipped=True)(_panel)
_COMPONENTS = Panel("position-components", "Position error of the end effector", "mm",
                    "position_error", position_components)
PANEL = {panel.name: panel for panel in (*PANELS, *TASK_PANELS, _COMPONENTS)}


def _distance(ax: Axes, recording: Recording, signal: str, colour: str) -> Array:
    """Draw a distance [m] and return it (T,): the true one, with the measured one behind it.

    Where no other is known, it is the measured one.
    """
    t, measured, true = recording["t"], recording[signal], f"true_{signal}"
    if true not in recording:
        drawing.curve(ax, t, measured, color=colour)
        return measured
    drawing.curve(ax, t, np.where(np.isfinite(measured), measured, np.nan), color=MEASURED,
                  linewidth=0.7, label="measured")
    drawing.curve(ax, t, recording[true], color=colour, label="true")
    return recording[true]


def _in_red(ax: Axes, t: Array, y: Array, mask: Array) -> None:
    if mask.any():
        drawing.curve(ax, t, np.where(mask, y, np.nan), color=ALERT, linewidth=1.7,
                      label="task active")


def _threshold(ax: Axes, t: Array, value: float, name: str) -> None:
    ax.axhline(value, color=INK, linewidth=0.6, linestyle=(0, (4, 3)))
    ax.annotate(name, (1.0, value), xycoords=("axes fraction", "data"), fontsize="small",
                va="bottom", ha="right", color=INK)
