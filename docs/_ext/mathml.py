"""Equations as MathML, which browsers draw themselves: no script, no font, no network."""

import re

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.util import logging

_log = logging.getLogger(__name__)
# docutils puts the index of an accented letter below it, as if it were a sum; and what is marked as
# an accent lies on its letter where there is no font for mathematics.
_ACCENTED = re.compile(r"<munderover>(\s*(?:<mi>[^<]*</mi>|<mover.*?</mover>))(.*?)"
                       r'(<mo stretchy="false">[¨˙ˆˉ]</mo>\s*)</munderover>', re.DOTALL)
# Browsers leave the room of a binary operator around these.
_TIGHT = re.compile(r'<mo(?: stretchy="false")?>([|‖/])</mo>')
_SIGN = re.compile(r"(<mo[^>]*>[=≤≥,(→∈]</mo>\s*)<mo>([−±])</mo>")
_FUNCTION = re.compile(r"<mo>(min|max)</mo>")


def setup(app):
    """Register the renderer under the name `mathml`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _inline(writer, node):
    writer.body.append(_drawn(node, as_block=False))
    raise nodes.SkipNode


def _block(writer, node):
    writer.body.append(f'<div class="math">{_drawn(node, as_block=True)}</div>\n')
    raise nodes.SkipNode


def _drawn(node, as_block):
    try:
        drawn = tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        _log.warning("equation %r: %s", node.astext(), error, location=node)
        return f"<code>{node.astext()}</code>"
    drawn = _ACCENTED.sub(r"<msub><mover>\1\3</mover>\2</msub>", drawn)
    drawn = _TIGHT.sub(r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>', drawn)
    drawn = _SIGN.sub(r'\1<mo form="prefix">\2</mo>', drawn)
    drawn = _FUNCTION.sub(r"<mi>\1</mi>", drawn)
    return drawn.replace('<mover accent="true">', "<mover>")
