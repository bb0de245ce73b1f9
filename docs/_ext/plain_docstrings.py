"""Docstrings are plain text; this makes reStructuredText of them, whatever characters they have.

Known are paragraphs, lists with "- ", indented code, headings underlined with "---", whose text
keeps its lines, and entries `name : text`, whose further lines may be indented. A name in backticks
links to what it names. Sections of a scenario file are shown without a signature: what keys they
have is on a page of its own.
"""

import re
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sphinx.util.typing import stringify_annotation

from hierarchy.problem import Array

_NAMED = r"[A-Za-z_*][\w*.\[\]/^ ]*(?:\([^()]*\))?"  # a name, maybe with a shape
_ENTRY = re.compile(rf"({_NAMED}(?:, {_NAMED})*) : ?(.*)")
# Sphinx writes aliases out, or the way in which it refers to them.
_ALIASES = {f"TypeAliasForwardRef('{name}')": name for name in ("Array", "ArrayLike")} | {
    stringify_annotation(alias, "smart"): name for alias, name in (
        (ArrayLike, "ArrayLike"), (Array, "Array"), (NDArray[np.int64], "NDArray[int64]"),
        (NDArray[np.bool_], "NDArray[bool]"), (NDArray[Any], "NDArray[Any]"))}
_ANNOTATED = re.compile(r"~?(?:\w+\.)*Annotated\[")
_TICKS = re.compile(r"`([^`]+)`")
_NAME = re.compile(r"[A-Za-z_][\w.]*")
_SPECIAL = re.compile(r"([\\*|`]|_(?=\W|$))")


def setup(app):
    """Convert every docstring that autodoc hands over."""
    app.connect("autodoc-process-docstring", lambda app, what, name, obj, options, lines:
                lines.__setitem__(slice(None), converted(lines)))
    app.connect("autodoc-process-signature", lambda app, what, name, obj, options, taken, returned:
                ("", None) if hasattr(obj, "model_fields") else (_short(taken), _short(returned)))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _short(signature):
    """Return a signature, or None, with the names of aliases and without what fields ask for."""
    for written, alias in _ALIASES.items() if signature else ():
        signature = signature.replace(written, alias)
    while found := _ANNOTATED.search(signature or ""):
        first, last = _parts_within(signature, found.end())
        signature = signature[:found.start()] + signature[found.end():first] + signature[last + 1:]
    return signature


def _parts_within(signature, start):
    """Return where the first part of what is in brackets from `start` on ends, and where all."""
    depth, ends = 0, []
    for i in range(start, len(signature)):
        depth += (signature[i] in "[(") - (signature[i] in "])")
        if depth < 0 or (depth == 0 and signature[i] == ","):
            ends.append(i)
        if depth < 0:
            return ends[0], i
    raise ValueError(signature)


def converted(lines):
    """Return the lines of a docstring as reStructuredText."""
    blocks = re.split(r"\n\s*\n", "\n".join(lines).strip("\n"))
    return [line for block in blocks for line in [*_block(block.split("\n")), ""]]


def _block(lines):
    if len(lines) > 2 and re.fullmatch(r"-{3,}", lines[1].strip()):
        below = lines[2:]
        return [f"**{_marked(lines[0])}**", "", *(_block(below) if _ENTRY.fullmatch(below[0])
                                                  else [f"| {_marked(line)}" for line in below])]
    if lines[0].startswith(" "):
        return ["::", "", *(f"    {line}" for line in lines)]
    if lines[0].startswith("- "):
        return [f"- {_joined([item[0][2:], *item[1:]])}" for item in _split(lines, _is_item)]
    if _ENTRY.fullmatch(lines[0]):
        return [line for item in _split(lines, _ENTRY.fullmatch) for line in _entry(item)]
    listed = next((i for i, line in enumerate(lines) if _is_item(line)), len(lines))
    return [_joined(lines[:listed]), "", *(_block(lines[listed:]) if lines[listed:] else [])]


def _is_item(line):
    return line.startswith("- ")


def _split(lines, begins):
    """Cut lines into items; each begins where `begins` says so."""
    items = []
    for line in lines:
        if begins(line) or not items:
            items.append([])
        items[-1].append(line)
    return items


def _entry(lines):
    name, text = _ENTRY.fullmatch(lines[0]).groups()
    return [f"``{name}``", f"    {_joined([text, *lines[1:]])}", ""]


def _joined(lines):
    return _marked(" ".join(line.strip() for line in lines))


def _marked(text):
    """Escape what reStructuredText would take for markup, and mark what is in backticks."""
    parts = _TICKS.split(text)
    return "".join(_quoted(part) if i % 2 else _escaped(part) for i, part in enumerate(parts))


def _quoted(text):
    return f"\\ :py:obj:`{text}`\\ " if _NAME.fullmatch(text) else f"\\ ``{text}``\\ "


def _escaped(text):
    return _SPECIAL.sub(r"\\\1", text)
