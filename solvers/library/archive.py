"""Static libraries in the format of `ar` with a symbol table, as GNU and LLVM tools read them."""

from __future__ import annotations

import struct
from collections.abc import Sequence

_MAGIC = b"!<arch>\n"


def archive(name: str, content: bytes, symbols: Sequence[str]) -> bytes:
    """Return an archive with one object, in which a linker finds these symbols.

    The same object gives the same bytes: no time, no owner. name : at most 15 characters.
    """
    table = "".join(f"{symbol}\0" for symbol in symbols).encode()
    index_size = 4 + 4 * len(symbols) + len(table)
    at = len(_MAGIC) + 60 + index_size + index_size % 2
    index = struct.pack(f">{1 + len(symbols)}I", len(symbols), *[at] * len(symbols)) + table
    return _MAGIC + _member("/", index) + _member(f"{name}/", content)


def _member(name: str, content: bytes) -> bytes:
    """Return a member with its header of 60 bytes; the next one starts at an even offset."""
    header = f"{name:16}{0:<12}{0:<6}{0:<6}{'100644':8}{len(content):<10}`\n"
    return header.encode() + content + b"\n" * (len(content) % 2)
