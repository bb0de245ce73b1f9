"""One colour per resolver and one line style per variant, wherever they are drawn.

Any two of COLOURS are at least 16 apart in CIELAB, also as seen with protanopia, deuteranopia or
tritanopia (simulated after Machado, Oliveira, Fernandes 2009), and each is legible on white and on
near-black.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

Dash = tuple[float, ...]

# Okabe and Ito's colours, a brown and a violet.
COLOURS = {"tpm": "#0072b2", "recursive": "#e69f00", "augmented": "#cc79a7", "hqp": "#009e73",
           "hcod": "#d55e00", "sns": "#56b4e9", "weighted": "#884422", "reverse": "#8844ee"}
# For labels that are no resolver of this package.
SPARE = ("#7f8790", "#999933", "#aa0044", "#44aa99", "#cc6677", "#664466")

# Tol's light scheme, for bands with dark text: tasks of a stack.
_TASKS = {"position": "#77aadd", "pointing": "#eedd88", "avoidance": "#ee8866",
          "separation": "#ffaabb", "joint limits": "#dddddd"}
_MORE_TASKS = ("#44bb99", "#bbcc33", "#99ddff", "#aaaa00", "#c9a0dc")

SOLID: Dash = ()
_DASHES: tuple[Dash, ...] = (SOLID, (4.0, 1.6), (1.0, 1.4), (6.0, 1.4, 1.0, 1.4),
                             (6.0, 1.4, 1.0, 1.4, 1.0, 1.4), (9.0, 2.0), (2.2, 1.2))
_USUAL = ("", "proxqp")  # variants that share the plain name's line
_VARIANTS = {"published": _DASHES[1], "in-order": _DASHES[1], "optimal": _DASHES[1],
             "osqp": _DASHES[1], "daqp": _DASHES[2], "quadprog": _DASHES[3], "piqp": _DASHES[4],
             "clarabel": _DASHES[5], "slack": _DASHES[6]}


class Look(NamedTuple):
    """A colour as "#rrggbb", and dash lengths on and off in line widths; none is a solid line."""

    colour: str
    dash: Dash

    @property
    def line(self) -> Any:
        """The line style in matplotlib's form."""
        return (0, self.dash) if self.dash else "-"


def looks(labels: Iterable[str]) -> dict[str, Look]:
    """Return how to draw labels side by side, no two alike as long as dashes and colours last.

    A resolver keeps its colour; any other first word of labels gets an unused one. Variants that
    would have the same dashes get others.
    """
    labels = list(dict.fromkeys(labels))
    known = {_parts(label)[0] for label in labels} & set(COLOURS)
    free = [shade for name, shade in COLOURS.items() if name not in known]
    free = [*SPARE, *free] if known else [*free, *SPARE]
    shades, found = dict(COLOURS), dict[str, Look]()
    for label in sorted(labels, key=lambda label: _parts(label)[1] not in _USUAL):
        name, variant = _parts(label)
        if name not in shades:
            shades[name] = free.pop(0) if free else SPARE[0]
        own = SOLID if variant in _USUAL else _VARIANTS.get(variant, _DASHES[1])
        lines = (line for line in (own, *_DASHES)
                 if Look(shades[name], line) not in found.values())
        found[label] = Look(shades[name], next(lines, SOLID))
    return {label: found[label] for label in labels}


def task_colours(names: Iterable[str]) -> dict[str, str]:
    """Return a light colour for each task: its own, or the next unused one."""
    names = list(dict.fromkeys(names))
    others = [name for name in names if name not in _TASKS]
    left = (*_MORE_TASKS, *(shade for name, shade in _TASKS.items() if name not in names))
    return {name: _TASKS.get(name) or left[others.index(name) % len(left)] for name in names}


def _parts(label: str) -> tuple[str, str]:
    """Return resolver and variant of a label "hqp osqp" or "tpm-published", or a spec."""
    first, _, variant = label.partition(" ")
    name = first.partition(":")[0]
    resolver = name.removesuffix("-published")
    return resolver, variant if resolver == name else "published"
