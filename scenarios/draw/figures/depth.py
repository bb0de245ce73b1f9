"""A depth image with control points and distances, after figure 8 of the letter."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole
from scenarios.draw.figures import drawing
from scenarios.recording.recording import DepthView

_POINT, _NEAREST, _TIP = "#2fb344", "#2f6bff", "#17c3d6"
_SHADES = ListedColormap(np.repeat(np.linspace(1.0, 0.2, 256)[:, None], 3, axis=1)
                         ).with_extremes(bad="#000000")
_CONTRAST = 1.1  # everything farther than the points by this factor is equally dark
_AROUND = 0.35   # [m] shown around the points


def depth_figure(view: DepthView) -> Figure:
    """Return an image of the camera, its points as circles, lines to the pixels nearest to them.

    The line of D_minimal is blue, that of the end effector cyan, the others are thin. Near is
    bright, black is no reading. Only the surroundings of the points are shown.
    """
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    (height, width), (fx, fy, cx, cy) = view.image.shape, view.camera[:4].tolist()
    pinhole = Pinhole(width, height, fx, fy, cx, cy, view.camera[4:7],
                      view.camera[7:].reshape(3, 3))
    pixels = pinhole.project(view.points)
    reading = np.asarray(view.image, dtype=float)
    read = reading[reading > 0.0]
    near = float(np.quantile(read, 0.001)) if read.size else 0.0
    ax.imshow(np.where(reading > 0.0, reading, np.nan), cmap=_SHADES, vmin=near,
              vmax=max(_CONTRAST * float(pixels[:, 2].max()), near + 0.1), interpolation="nearest")
    ends = [divmod(int(at), pinhole.width)[::-1] if at >= 0 else None for at in view.pixel]
    tip = len(pixels) - 1
    for k, end in enumerate(ends):
        if end is not None and k not in (view.active, tip):
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=_POINT, linewidth=0.6, alpha=0.8)
    for k, colour, width, what in ((tip, _TIP, 3.2, "end effector"),
                                   (view.active, _NEAREST, 1.6, r"$D_{minimal}$")):
        end = ends[k] if k >= 0 else None
        if end is not None:
            ax.plot(*zip(pixels[k, :2], end, strict=True), color=colour, linewidth=width,
                    solid_capstyle="round", label=f"{what} {view.distance[k]:.2f} m")
    ax.plot(*pixels[:tip, :2].T, "o", markerfacecolor="none", markeredgecolor=_POINT,
            markersize=6, markeredgewidth=1.5)
    ax.plot(*pixels[tip, :2], "o", markerfacecolor="none", markeredgecolor=_TIP, markersize=8,
            markeredgewidth=1.8)
    _show(ax, np.vstack([pixels[:, :2], *(end for end in ends if end is not None)]),
          pinhole.fx * _AROUND / max(float(np.median(pixels[:, 2])), _AROUND), view.image.shape)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.1,
                  borderpad=0.0, handlelength=1.4, frameon=False, fontsize=9.0)
    ax.set_title(f"t = {view.t:.2f} s", pad=4.0, loc="left", fontsize=9.0)
    return fig


def _show(ax: Axes, pixels: Array, around: float, shape: tuple[int, ...]) -> None:
    """Show the pixels (K, 2) and their surroundings, in the proportions of the image."""
    height, width = shape
    low, high = pixels.min(axis=0) - around, pixels.max(axis=0) + around
    share = min(max((high[0] - low[0]) / width, (high[1] - low[1]) / height), 1.0)
    u = np.clip((low[0] + high[0] - share * width) / 2, 0.0, width * (1.0 - share)) - 0.5
    v = np.clip((low[1] + high[1] - share * height) / 2, 0.0, height * (1.0 - share)) - 0.5
    ax.set_xlim(u, u + share * width)
    ax.set_ylim(v + share * height, v)
    ax.set_axis_off()
