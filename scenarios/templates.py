"""Jinja templates of the pages: every value is escaped unless it is markup already."""

import re
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from hierarchy.words import listed
from scenarios.files import slug

_CODE = re.compile(r"`([^`]+)`")
_UNIT = r"(?: (?:%|[µm]?m|s|N m|N|rad/s|rad)(?![\w/]))"
_NUMBER = re.compile(rf"\d[\d.]*(?:e[-+]\d+{_UNIT}?|{_UNIT})")


def render(template: str, **values: Any) -> Markup:
    """Return a template, by its path in this package, filled in with values."""
    return Markup(_environment().get_template(template).render(values))


def filled(text: str, **values: Any) -> Markup:
    """Return a template given as text, which may extend those of this package, filled in."""
    return Markup(_environment().from_string(text).render(values))


def resource(name: str) -> Markup:
    """Return a style sheet or a script, by its path in this package, as it is."""
    return Markup(files("scenarios").joinpath(name).read_text(encoding="utf-8"))


def unbroken(text: str) -> Markup:
    """Return text in which no line ends inside a number such as 4e-08, or before its unit."""
    return Markup(_NUMBER.sub(r'<span class="number">\g<0></span>', str(escape(text))))


def code(text: str) -> Markup:
    """Return text with what is between backticks set as code."""
    return Markup(_CODE.sub(r"<code>\g<1></code>", str(escape(text))))


@cache
def _environment() -> Environment:
    made = Environment(loader=PackageLoader("scenarios", "."), autoescape=True,
                       undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    made.filters |= {"code": code, "unbroken": unbroken, "listed": listed, "slug": slug}
    return made
