"""Read TOML; an error shows the line, a caret and the likely mend."""

import re
import tomllib
import unicodedata
from pathlib import Path
from typing import Any

from hierarchy.errors import HierarchyError

_SHOWN = 90  # columns of a line
_TOKEN = re.compile(r'"""[\s\S]*?"""|' r"'''[\s\S]*?'''|" r'"(?:\\.|[^"\\\n])*"|' r"'[^'\n]*'|"
                    r"""#[^\n]*|[\[\]{}"']""")
_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")
_NEXT = re.compile(r"""\s*(?:[\w."'-]+\s*=|\[\[?[A-Za-z_][\w.-]*\]\]?\s*(?:#|$))""")
_QUOTED = "put a name with other characters than A-Z, a-z, 0-9, _ and - in quotes"
_AT = "\f"  # in patterns: where the parser stopped; TOML has no form feed

# What tomllib says, what the line looks like there, and the mend; the first that fits counts.
_MENDS = tuple((said, re.compile(pattern), mend) for said, pattern, mend in (
    ("", "\f[“”„‟«»‘’‚‛`´]", 'write straight quotes: "text"'),
    ("", r"=\s*\f=|\f:=", "write one ="),
    ("", r"\f\s*(//|--)", "a comment begins with #"),
    ("", r"\f<<<<<<<", "a merge left this mark"),
    ("Expected '='", r"^\s*[\w.-]+\f:\s*$", "a section begins with [name]"),
    ("Expected '='", r"\f\s*(?:=>|\+=|:)", "write = between a key and its value"),
    ("Expected '='", r"\f[^\"'=]+=", _QUOTED),
    ("Expected '='", "", "write key = value"),
    ("Expected ']", r"\f\s*[^\s\]]", _QUOTED),
    ("Expected ']]'", "", "close the name of the section with ]]"),
    ("Expected ']'", "", "close the name of the section with ]"),
    ("Illegal character '\\n'", "", "close the text with the quote that it begins with"),
    ("Illegal character", "", "leave out this control character"),
    ("Unescaped", "", "write / for each \\, or put the text in single quotes: 'text'"),
    ("Invalid value", r"\f(True|False|Inf|NaN|TRUE|FALSE)\b", "write it in lower case"),
    ("Invalid value", r"\f(None|null|nil)\b", "leave the key out: nothing has no value"),
    ("Invalid value", r"\f(yes|no|on|off)\b", "write true or false"),
    ("Invalid value", r"\f[+-]?\.\d", "write a digit before the point"),
    ("Invalid value", r"\f\s*(#.*)?$", "write a value after the ="),
    ("Invalid value", r"\f\s*,", "leave out this comma"),
    ("Invalid value", r"\f\(", "write a list in brackets: [1, 2]"),
    ("Invalid value", r"\f([^\s,\]}#\"']+)", 'put text in quotes: "…"'),
    ("Invalid statement", r"\f=", "write a key before the ="),
    ("Invalid statement", r"\f\{", "write key = value in lines; a section begins with [name]"),
    ("Unclosed inline", r"\f\s*$", "write what is between { and } in one line"),
    ("Unclosed", r"\f\s*;", "write a comma here"),
    ("Unclosed", r"\f\s*\S", "write a comma before this"),
    ("Invalid initial", r",\s*\f\}", "leave out the comma before }"),
    ("Invalid initial", "", "write a name here"),
    ("Expected newline", r"\d\f\.", "write a digit after the point"),
    ("Expected newline", r"\f\s*,", "write a list in brackets, [1, 2], and a decimal point as ."),
    ("Expected newline", r"\f\s*;", "leave out the ;"),
    ("Expected newline", r"=\s*[+-]?0\f\d", "leave out the zero in front"),
    ("Expected newline", r"\f\s*[\]})]", "leave out this bracket, or open it before"),
    ("Expected newline", r"^\s*\[.*\]\s*\f", "begin a new line after the name of a section"),
    ("Expected newline", r"\f\s*[\w.-]+\s*=", "begin a new line for each key"),
    ("Expected newline", r"=\s*[\d.e+-]+\s*\f", "write one number alone, without unit or "
                                                "arithmetic"),
    ("Expected newline", "", "check the quotes: the value ends before this"),
    ("Cannot", "", "it stands above already: leave out one of the two; for a list of tables, "
                   "write [[name]] above each")))


def read_toml(path: Path, what: str, error: type[HierarchyError]) -> dict[str, Any]:
    """Return the content of a TOML file; raises `error`, naming the file, if it cannot be read.

    `what` is the kind of file in the message, such as "scenario file".
    """
    what = f"{what} {str(path)!r}"
    try:
        data = path.read_bytes()
        return parse(data.decode("utf-8-sig"), what, error)
    except FileNotFoundError as cause:
        raise error(f"{what} does not exist") from cause
    except OSError as cause:
        raise error(f"{what}: {cause.strerror}") from cause
    except UnicodeDecodeError as cause:
        line = data[:cause.start].count(b"\n") + 1
        raise error(f"{what}, line {line}, is not UTF-8 text: save it in the encoding UTF-8"
                    ) from cause


def parse(text: str, what: str, error: type[HierarchyError]) -> dict[str, Any]:
    """Return the content of a TOML text; raises `error`, with line, caret and mend."""
    text = text.replace("\r\n", "\n")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as cause:
        said, at, mend = _slip(text, str(cause))
        line, column = text.count("\n", 0, at) + 1, at - text.rfind("\n", 0, at)
        raise error(f"{what}, line {line}, column {column}: {said}\n{_pointed(text, at)}"
                    + (f"\n  {mend}" if mend else "")) from cause
    except RecursionError as cause:
        raise error(f"{what} is nested too deep") from cause
    except ValueError as cause:
        raise error(f"{what} has an integer of thousands of digits") from cause


def _slip(text: str, said: str) -> tuple[str, int, str]:
    """Return what is wrong in a text, at which character, and the mend if one is known."""
    found = _PLACE.search(said)
    said, at = _PLACE.sub("", said), len(text)
    if found and found[1]:
        lines = text.split("\n")[:int(found[1]) - 1]
        at = sum(map(len, lines)) + len(lines) + int(found[2]) - 1
    begins, ends = text.rfind("\n", 0, at) + 1, (text + "\n").find("\n", at)
    opened = _opened(text[:at])
    if opened is not None and (at == len(text) or (
            not text[begins:at].strip() and _NEXT.match(text, at))):
        return said, opened, f"close this {text[opened]}"
    if said.startswith("Cannot"):  # the parser stops behind the key
        at = begins + len(text[begins:at]) - len(text[begins:at].lstrip())
    elif (mend := _of_character(text[at:at + 1], said)) is not None:
        return said, at, mend
    line = text[begins:at] + _AT + text[at:ends]
    return said, at, next((mend.replace("…", found[1]) if found.lastindex else mend
                           for start, pattern, mend in _MENDS if said.startswith(start)
                           and (found := pattern.search(line))), "")


def _of_character(character: str, said: str) -> str | None:
    """Return the mend of a character that TOML has within quotes only, if an ASCII one is meant."""
    if not character or character.isascii() or (
            character.isalpha() and said.startswith(("Expected '='", "Expected ']", "Invalid i"))):
        return None
    dash = unicodedata.category(character) == "Pd" or character == "−"
    meant = "-" if dash else unicodedata.normalize("NFKD", character)
    name = unicodedata.name(character, "unnamed").lower()
    return f"write {'a space' if meant == ' ' else meant} for this {name}" \
        if meant.isascii() else None


def _opened(text: str) -> int | None:
    """Return where the innermost bracket or the quote begins that is open at the end of a text."""
    stack: list[int] = []
    for token in _TOKEN.finditer(text):
        if token[0] in ("[", "{"):
            stack.append(token.start())
        elif token[0] in ("]", "}"):
            del stack[-1:]
        elif token[0] in ('"', "'"):
            return token.start()
    return stack[-1] if stack else None


def _pointed(text: str, at: int) -> str:
    """Return the line of a character, and a caret under it."""
    begins = text.rfind("\n", 0, at) + 1
    line, column = text[begins:(text + "\n").find("\n", at)].replace("\t", " "), at - begins
    first = max(0, column - 2 * _SHOWN // 3)
    shown = "".join(c if c.isprintable() else "?" for c in line[first:first + _SHOWN])
    return f"    {shown}\n    {' ' * (column - first)}^"
