"""The style of all figures: colours, thinning of long curves, projection, SVG for a page."""

import io
import itertools
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib
import matplotlib.style
import numpy as np
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatter
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.draw.figures.palette import looks

# Text, axes and desired curves. In an inline SVG it becomes the text colour of the page.
INK = "#0b0c0d"
ALERT = "#d33a2c"
MEASURED = "#9aa1a9"  # what a sensor says, beside what is true

# Tol's bright scheme, for the joints of one robot.
JOINTS = ("#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#999999", "#dd7733")

_SCREEN: dict[Any, Any] = {
    "font.size": 9.0, "axes.titlesize": 9.0, "axes.titlelocation": "left", "legend.frameon": False,
    "axes.edgecolor": INK, "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK,
    "ytick.color": INK, "grid.color": INK, "grid.alpha": 0.12, "grid.linewidth": 0.6,
    "axes.grid": True, "axes.linewidth": 0.6, "lines.linewidth": 1.0, "axes.facecolor": "none",
    "axes.spines.top": False, "axes.spines.right": False, "xtick.major.width": 0.6,
    "ytick.major.width": 0.6, "svg.fonttype": "none", "figure.dpi": 72.0}
# Line styles that differ in grey, one for each of JOINTS.
_IN_GREY = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (3, 1)), (0, (1, 3)))
_PAPER = {**_SCREEN, "font.family": ["STIXGeneral", "DejaVu Serif"], "mathtext.fontset": "stix",
          "font.size": 8.0, "axes.titlesize": 8.0, "pdf.fonttype": 42}


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class _Powers(LogFormatter):
    """Labels of a logarithmic axis as plain text, which takes a tenth of the time of formulas.

    They are `20`, `10⁻⁸` or `2·10⁵`.
    """

    def __call__(self, x: float, pos: int | None = None) -> str:
        if not super().__call__(x, pos):
            return ""
        if 1e-2 <= x < 1e4:
            return f"{x:g}"
        mantissa, exponent = f"{x:.0e}".split("e")
        power = "10" + str(int(exponent)).translate(_RAISED)
        return power if mantissa == "1" else f"{mantissa}·{power}"


def make_logarithmic(ax: Axes, which: Literal["x", "y"]) -> None:
    """Give the axis x or y of a plot a logarithmic scale."""
    ax.set(**{f"{which}scale": "log"})
    axis = ax.xaxis if which == "x" else ax.yaxis
    axis.set_major_formatter(_Powers())
    axis.set_minor_formatter(_Powers())


@dataclass(frozen=True)
class Style:
    """How figures are drawn: matplotlib's settings and a few more.

    width [in] of every figure, or None for its own; titled: whether figures name their run; formats
    of the files; lines: line styles of the joints in turn.
    """

    settings: dict[Any, Any]
    width: float | None
    titled: bool
    formats: tuple[str, ...]
    lines: tuple[Any, ...] = ("-",)


SCREEN = Style(_SCREEN, None, True, ("svg", "png"))
# One column of an IEEE journal, with the usual font size of its figures.
PAPER = Style(_PAPER, 3.5, False, ("pdf",), _IN_GREY)
STYLES = {"screen": SCREEN, "paper": PAPER}
_LEAST_HEIGHT = 0.75  # of a narrowed figure, relative to its own: the font size stays
_BUCKETS = 350  # of a thinned curve
_present: ContextVar[Style] = ContextVar("style", default=SCREEN)


@contextmanager
def styled(style: Style) -> Iterator[None]:
    """Draw and write all figures in a style within the context, whatever the user's own is."""
    token = _present.set(style)
    try:
        with matplotlib.style.context(["default", style.settings]):
            yield
    finally:
        _present.reset(token)


def present() -> Style:
    """Return the present style."""
    return _present.get()


def colours(labels: Iterable[str]) -> dict[str, str]:
    """Return the colour of each label; variants of a resolver share one, see `palette.looks`."""
    return {label: look.colour for label, look in looks(labels).items()}


def joint_line(joint: int) -> dict[str, Any]:
    """Return colour and line style of a joint, numbered from 0, as matplotlib keywords."""
    lines = present().lines
    return {"color": JOINTS[joint % len(JOINTS)], "linestyle": lines[joint % len(lines)]}


def figure(rows: int = 1, width: float = 3.3, height: float = 2.1) -> tuple[Figure, list[Axes]]:
    """Return a figure of `rows` axes one below the other, in the present style; sizes in inches."""
    if (fixed := present().width) is not None:
        width, height = fixed, height * min(max(fixed / width, _LEAST_HEIGHT), 1.0)
    with matplotlib.rc_context(present().settings):
        fig = Figure(figsize=(width, height), layout="constrained")
        axes = fig.subplots(rows, 1, sharex=True, squeeze=False)[:, 0]
    return fig, list(axes)


def envelope(y: Array) -> NDArray[np.int64]:
    """Return the indices that keep the shape of a long curve y (T,): extremes of each bucket.

    Every bucket's smallest and largest value, and so every peak, is kept. NaN is left out.
    """
    if len(y) <= 3 * _BUCKETS:
        return np.arange(len(y))
    edges = np.linspace(0, len(y), _BUCKETS + 1).astype(int)
    kept = {0, len(y) - 1}
    for first, last in itertools.pairwise(edges.tolist()):
        known = first + np.flatnonzero(~np.isnan(y[first:last]))
        kept.update([known[y[known].argmin()], known[y[known].argmax()]] if known.size else [first])
    return np.array(sorted(kept))


def curve(ax: Axes, t: Array, y: Array, **style: Any) -> None:
    """Plot y over t, thinned."""
    kept = envelope(y)
    ax.plot(t[kept], y[kept], **style)


def spans(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return (first, last + 1) of every run of True in mask (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def project(points: Array, azimuth: float = 150.0, elevation: float = 30.0) -> Array:
    """Return the orthographic picture (..., 2) of points (..., 3); angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    up = np.array([-np.sin(e) * np.cos(a), -np.sin(e) * np.sin(a), np.cos(e)])
    return np.asarray(points @ np.column_stack([right, up]))


def svg(fig: Figure, title: str) -> Markup:
    """Return a figure as a scalable inline `<svg>` with a title, in the colours of the page."""
    text = io.StringIO()
    with matplotlib.rc_context({**present().settings, "svg.hashsalt": title}):
        fig.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    body = text.getvalue()[text.getvalue().index("<svg"):]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r' id="[a-zA-Z0-9]+_\d+"', "", body)
    body = re.sub(r"<!--.*?-->\s*|\s*\n\s*", lambda m: "" if m[0][0] == "<" else " ", body)
    body = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d)\d+", r"\1", path[0]),
                  body)  # to a tenth of a point, which cannot be seen
    body = body.replace(INK, "currentColor").replace("'DejaVu Sans'", "inherit")
    head = f'<svg role="img" aria-label="{escape(title)}" viewBox="'
    return Markup(re.sub(r'<svg [^>]*?viewBox="', lambda _: head, body, count=1))


def write(fig: Figure, stem: str) -> None:
    """Write a figure on white as stem.svg, stem.png or stem.pdf, following the present style.

    The same figure gives the same bytes: no file has a date.
    """
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with matplotlib.rc_context({**present().settings, "svg.hashsalt": "task-hierarchy"}):
        fig.draw_without_rendering()  # arranges the figure, once for all formats
        fig.set_layout_engine("none")
        for kind in present().formats:
            fig.savefig(f"{stem}.{kind}", facecolor="white", dpi=160, metadata=undated.get(kind))
