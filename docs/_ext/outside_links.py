"""Links from a document to the source tree, which is not part of the site.

On a code host `[plants](../scenarios/cell/plants)` leads there. In the site it is the text and
the path.
"""

import re
from pathlib import Path

_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\((\.\.?/[^)#\s]+)(#[^)\s]*)?\)")


def setup(app):
    """Rewrite each document before it is parsed."""
    app.connect("source-read", _rewrite)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _rewrite(app, docname, source):
    docs = Path(app.srcdir).resolve()
    here = (docs / docname).parent

    def shown(link):
        text, target = link[1], (here / link[2]).resolve()
        if target.is_relative_to(docs):
            return link[0]
        path = f"`{target.relative_to(docs.parent)}`"
        return path if text.strip("`") in path else f"{text} ({path})"

    source[0] = _LINK.sub(shown, source[0])
