"""A depth image with control points and distances drawn in, after figure 8 of the letter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from hierarchy import HierarchyError
from hierarchy.problem import Array
from scenarios.cell.build import build
from scenarios.cell.sensors import DepthSensor
from scenarios.draw.figures import drawing

if TYPE_CHECKING:
    from scenarios.loop.recording import Recording

_POINT, _NEAREST, _TIP = "#2fb344", "#2f6bff", "#17c3d6"
_NO_READING = "#000000"
_SHADES = ListedColormap(np.repeat(np.linspace(1.0, 0.2, 256)[:, None], 3, axis=1))
_CONTRAST = 1.1  # all is as dark that is farther than the points by this factor
_AROUND = 0.35   # [m] that is shown around the points, beside and beyond them


def depth_figure(recording: Recording, t: float) -> Figure:
    """Return what the camera of a run saw at time t [s], and which distances came of it.

    Raises HierarchyError for a run without a camera.
    """
    scenario = recording.scenario
    sensor = scenario.sensor.model_copy(update={"latency": 0.0})
    cell = build(scenario.model_copy(update={"sensor": sensor}))
    if not isinstance(cell.sensor, DepthSensor):
        raise HierarchyError(f"scenario {scenario.name!r} has no camera")
    k = int(np.argmin(np.abs(recording["t"] - t)))
    cell.state.move(float(recording["t"][k]), recording["q"][k], recording["v"][k])
    cell.sensor.measure(cell.state)
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    draw_depth(ax, cell.sensor)
    ax.set_title(f"t = {recording['t'][k]:.2f} s", pad=4.0, loc="left", fontsize=9.0)
    return fig


def draw_depth(ax: Axes, sensor: DepthSensor) -> None:
    """Draw the last image of a sensor, its points as circles, and lines to what they are near to.

    Blue is the line of D_minimal, cyan that of the end effector, those of the others are thin.
    Near is bright; black has no reading. Only what is around the points is shown.
    """
    seen, pinhole = sensor.measurement, sensor.space.pinhole
    if sensor.reading is None:
        raise HierarchyError("the sensor has taken no image")
    pixels = pinhole.project(seen.points)
    _image(ax, np.asarray(sensor.reading, dtype=float), pixels[:, 2])
    ends = [divmod(int(at), pinhole.width)[::-1] if at >= 0 else None for at in seen.nearest]
    tip = len(pixels) - 1
    for k, end in enumerate(ends):
        if end is not None and k not in (seen.active, tip):
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=_POINT, linewidth=0.6, alpha=0.8)
    for k, colour, width, what in ((tip, _TIP, 3.2, "end effector"),
                                   (seen.active, _NEAREST, 1.6, r"$D_{minimal}$")):
        end = ends[k] if k >= 0 else None
        if end is not None:
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=colour, linewidth=width,
                    solid_capstyle="round", label=f"{what} {seen.distance[k]:.2f} m")
    ax.plot(*pixels[:tip, :2].T, "o", markerfacecolor="none", markeredgecolor=_POINT,
            markersize=6, markeredgewidth=1.5)
    ax.plot(*pixels[tip, :2], "o", markerfacecolor="none", markeredgecolor=_TIP, markersize=8,
            markeredgewidth=1.8)
    _show(ax, np.vstack([pixels[:, :2], *(end for end in ends if end is not None)]),
          pinhole.fx * _AROUND / max(float(np.median(pixels[:, 2])), _AROUND), sensor)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1,
                  borderpad=0.0, handlelength=1.4, frameon=False, fontsize=9.0)


def _image(ax: Axes, reading: Array, depths: Array) -> None:
    read = reading[reading > 0.0]
    near = float(np.quantile(read, 0.001)) if read.size else 0.0
    far = max(_CONTRAST * float(depths.max()), near + 0.1)
    shades = _SHADES.with_extremes(bad=_NO_READING)
    ax.imshow(np.where(reading > 0.0, reading, np.nan), cmap=shades, vmin=near, vmax=far,
              interpolation="nearest")


def _show(ax: Axes, pixels: Array, around: float, sensor: DepthSensor) -> None:
    """Show the pixels (K, 2) and what is around them, in the proportions of the image."""
    width, height = sensor.space.pinhole.width, sensor.space.pinhole.height
    low, high = pixels.min(axis=0) - around, pixels.max(axis=0) + around
    share = min(max((high[0] - low[0]) / width, (high[1] - low[1]) / height), 1.0)
    u = np.clip((low[0] + high[0] - share * width) / 2, 0.0, width * (1.0 - share)) - 0.5
    v = np.clip((low[1] + high[1] - share * height) / 2, 0.0, height * (1.0 - share)) - 0.5
    ax.set_xlim(u, u + share * width)
    ax.set_ylim(v + share * height, v)
    ax.set_axis_off()
