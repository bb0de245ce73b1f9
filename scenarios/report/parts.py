"""Small pieces of HTML that the sections of the report are made of."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from matplotlib.figure import Figure

from scenarios.draw.figures import drawing
from scenarios.draw.figures.palette import Look


def chip(look: Look) -> str:
    """Return a short line in the colour and the dashes of a label."""
    dashes = " ".join(f"{2.4 * length:g}" for length in look.dash)
    dashed = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (f'<svg class="line" viewBox="0 0 24 8" aria-hidden="true"><path d="M1 4H23" '
            f'stroke="{look.colour}" stroke-width="4"{dashed}/></svg>')


def square(colour: str) -> str:
    """Return a small square of a colour."""
    return f'<span class="chip" style="background:{colour}"></span>'


def legend(looks: Mapping[str, Look]) -> str:
    """Return the labels with their lines."""
    return _row(f"<span>{chip(look)}{escape(label)}</span>" for label, look in looks.items())


def squares(colours: Mapping[str, str]) -> str:
    """Return names with their colours."""
    return _row(f"<span>{square(colour)}{escape(name)}</span>" for name, colour in colours.items())


def joints(count: int) -> str:
    """Return the colours of so many joints."""
    return squares({f"joint {j + 1}": drawing.joint_colour(j) for j in range(count)})


def picture(caption: str, fig: Figure, title: str) -> str:
    """Return a figure under a caption, which is HTML already."""
    return (f"<figure><figcaption>{caption}</figcaption>{drawing.svg(fig, title)}</figure>")


def section(title: str, body: str, said: str = "", unit: str = "") -> str:
    """Return a section; `title`, `said` and `unit` are plain text, `body` is HTML."""
    small = f" <small class='quiet'>{escape(unit)}</small>" if unit else ""
    lead = f'<p class="quiet">{escape(said)}</p>' if said else ""
    return f"<section><h2>{escape(title)}{small}</h2>\n{lead}{body}</section>"


def unbroken(text: str) -> str:
    """Return text as HTML in which no line ends inside a number such as 4e-08."""
    return re.sub(r"[0-9.]+e-[0-9]+", r'<span class="number">\g<0></span>', escape(text))


def plain_table(rows: Iterable[Sequence[str]], head: Sequence[str] = ()) -> str:
    """Return a table whose cells are HTML already, in a box that scrolls."""
    body = "".join(f"<tr><th>{first}</th>{''.join(f'<td>{cell}</td>' for cell in rest)}</tr>"
                   for first, *rest in rows)
    heads = "".join(f"<th>{escape(name)}</th>" for name in head)
    top = f"<thead><tr>{heads}</tr></thead>" if head else ""
    return f'<div class="scroll"><table class="plain">{top}<tbody>{body}</tbody></table></div>'


def folded(summary: str, body: str) -> str:
    """Return what is shown when its summary is clicked."""
    return f"<details><summary>{escape(summary)}</summary>\n{body}</details>"


def _row(items: Iterable[str]) -> str:
    return f'<div class="legend">{"".join(items)}</div>'
