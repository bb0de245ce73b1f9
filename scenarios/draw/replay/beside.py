"""The right part of a video frame: the stack as a list, and curves with a cursor."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from PIL import Image, ImageDraw, ImageFont

from hierarchy.problem import Array
from scenarios.draw.figures import drawing
from scenarios.recording.fate import Fate, phrase
from scenarios.scene import Scene, Series

_INK, _QUIET = (26, 29, 33), (92, 101, 112)
_ROWS = {Fate.MET: (207, 230, 218), Fate.FREE: (227, 231, 236), Fate.MISSED: (243, 201, 139),
         Fate.UNKNOWN: (227, 231, 236)}


class Beside:
    """Draws list and cursor of each frame onto curves that are drawn once; size in pixels."""

    def __init__(self, scene: Scene, label: str, colour: str, size: tuple[int, int]) -> None:
        self.scene, self.label = scene, label
        self._curves, self._cursor = _curves(scene, colour, size)
        self._bold, self._plain = _font("DejaVuSans-Bold"), _font("DejaVuSans")

    def draw(self, f: int) -> Image.Image:
        """Return the right part of frame f."""
        scene, image = self.scene, self._curves.copy()
        draw, right = ImageDraw.Draw(image), image.width - 16
        draw.text((16, 10), self.label, _INK, self._bold)
        draw.text((right, 10), f"{scene.t[f]:.2f} s", _INK, self._plain, anchor="ra")
        for rank, task in enumerate(scene.orders[scene.order[f]]):
            self._row(draw, f, 36 + 26 * rank, f"{rank + 1}   {task}", task, right)
        draw.text((16, _head(scene) - 22), _saturated(scene, f), _QUIET, self._plain)
        x, spans = self._cursor(scene.t[f])
        for top, bottom in spans:
            draw.line((x, top, x, bottom), _INK, 1)
        return image

    def _row(self, draw: ImageDraw.ImageDraw, f: int, y: int, text: str, task: str,
             right: int) -> None:
        levels = self.scene.levels
        n = levels.names.index(task)
        fate = Fate(int(levels.fate[f, n]))
        draw.rounded_rectangle((14, y, right + 2, y + 23), 5, _ROWS[fate])
        draw.text((22, y + 3), text, _INK, self._plain)
        draw.text((right - 6, y + 3), phrase(fate, levels.violation[f, n]), _INK, self._plain,
                  anchor="ra")


def _saturated(scene: Scene, f: int) -> str:
    joints = [f"{j + 1}{'+' if side > 0 else '-'}"
              for j, side in enumerate(scene.levels.saturated[f]) if side]
    return f"joints at a limit: {', '.join(joints)}" if joints else ""


def _head(scene: Scene) -> int:
    """Return the height [px] of the part above the curves."""
    return 62 + 26 * max((len(order) for order in scene.orders), default=0)


def _curves(scene: Scene, colour: str, size: tuple[int, int]) -> tuple[Image.Image, Any]:
    """Return the curves as an image, and a function from t [s] to the cursor's place in it."""
    head, dots = _head(scene), 100.0
    with matplotlib.rc_context(drawing.style()):
        fig = Figure(figsize=(size[0] / dots, (size[1] - head) / dots), dpi=dots,
                     layout="constrained", facecolor="white")
        axes = fig.subplots(len(scene.series), 1, sharex=True, squeeze=False)[:, 0]
        for ax, series in zip(axes, scene.series, strict=True):
            _curve(ax, scene.t, series, colour)
        written = io.BytesIO()
        fig.savefig(written, format="png", dpi=dots)
    drawn = Image.open(written).convert("RGB")
    image = Image.new("RGB", size, "white")
    image.paste(drawn, (0, head))
    bottom = head + drawn.height
    spans = [(bottom - ax.bbox.y1, bottom - ax.bbox.y0) for ax in axes]
    return image, lambda t: (float(axes[0].transData.transform((t, 1.0))[0]), spans)


def _curve(ax: Any, t: Array, series: Series, colour: str) -> None:
    for c in range(series.value.shape[1]):
        one = colour if series.value.shape[1] == 1 else drawing.JOINTS[c % len(drawing.JOINTS)]
        ax.fill_between(t, series.low[:, c], series.high[:, c], color=one, linewidth=0.6)
        ax.plot(t, series.value[:, c], color=one, linewidth=0.9)
    for symbol, value in series.marks:
        ax.axhline(value, color=drawing.ALERT, linewidth=0.7, linestyle=(0, (4, 3)))
        ax.annotate(symbol, (1.0, value), xycoords=("axes fraction", "data"), ha="right",
                    va="bottom", fontsize=7)
    if series.logarithmic:
        ax.set_yscale("log", nonpositive="clip")
    ax.set_title(f"{series.name} [{series.unit}]", fontsize=8, pad=2)
    ax.tick_params(labelsize=7)
    ax.set_xlim(t[0], max(t[-1], t[0] + 1e-9))


def _font(name: str) -> Any:
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / f"fonts/ttf/{name}.ttf"), 14)
