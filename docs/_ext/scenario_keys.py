"""Write the keys into the page of the scenario file: `python docs/_ext/scenario_keys.py`.

They stand below a mark, and are what `hierarchy help KEY` prints. A key that several sections have
is described in the first of them.
"""

import inspect
import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "api" / "scenario-file.md"
MARK = "<!-- below: written by `python docs/_ext/scenario_keys.py` -->\n"
_SLUG = str.maketrans("", "", "[].")


def written():
    """Return the page with its keys as they should be."""
    return f"{PAGE.read_text(encoding='utf-8').partition(MARK)[0]}{MARK}\n" + "\n".join(_lines())


def _lines():
    """Yield the lines of every place."""
    from scenarios.config.reference import keys_of, sections

    groups, meaning = {}, {}
    for place, section in sections():
        groups.setdefault(place, []).append(section)
        for key in keys_of(section):
            for below in key.below:
                meaning.setdefault(below, key.meaning)
    writer = _Writer({one: place for place, group in groups.items() for one in group})
    for place, group in groups.items():
        said = inspect.getdoc(group[0]) if len(group) == 1 else meaning[group[0]]
        yield from (f"## {f'`{place}`' if place else 'Top of the file'}", "", _escaped(said), "")
        yield from _single(writer, place, group[0]) if len(group) == 1 else (
            _several(writer, place, group))
        yield ""


def _single(writer, place, section):
    """Yield the keys of a section; at the top of the file those of sections are one entry."""
    from scenarios.config.reference import keys_of

    keys = keys_of(section)
    yield from writer.entries((place,), (key for key in keys if place or not key.below))
    if not place:
        yield f"- sections: {', '.join(writer.linked(key) for key in keys if key.below)}"


def _several(writer, place, group):
    """Yield what all kinds of a place have, then each kind."""
    from scenarios.config.reference import Scenario, keys_of, kinds_of, tag_at

    kinds = {kinds_of(one)[0]: one for one in group if kinds_of(one)}
    _, default = tag_at(Scenario, place.strip("[]").split("."))
    default = f' (`"{default}"`)' if default else "\\*"
    plugin = "" if len(kinds) == len(group) else ", or of a plug-in"
    yield f"- **kind**{default}: one of these{plugin}"
    common = set.intersection(*({*map(_same, keys_of(one))} for one in kinds.values()))
    yield from writer.entries((place,), (
        key for key in keys_of(group[0]) if _same(key) in common))
    for kind, one in kinds.items():
        entries = [*writer.entries((place, kind), keys_of(one))]
        yield from ("", f"### `{kind}`", "", _escaped(inspect.getdoc(one)),
                    *([""] if entries else []), *entries)


class _Writer:
    """Writes entries: `places` of all sections, and where each key was `first` described."""

    def __init__(self, places):
        self.places, self.first = places, {}

    def entries(self, here, keys):
        """Yield the entries of keys that are described `here`, and where the others are."""
        elsewhere = {}
        for key in keys:
            above, default = self.first.setdefault(_same(key), (here, key.default))
            if above == here:
                yield self._entry(key)
            elif above != here[:1] or key.default != default:
                names = " ".join(f"`{part}`" for part in above[above[0] == here[0]:] or above)
                other = f" ({key.default or 'optional'})" if key.default != default else ""
                elsewhere.setdefault(names, []).append(f"`{key.name}`{other}")
        if elsewhere:
            listed = [f"{above}: {', '.join(names)}" for above, names in elsewhere.items()]
            yield f"- as in {'; '.join(listed)}"

    def linked(self, key):
        """Return links to the sections that a key may have, and whether it has to have one."""
        links = (f"[`{one}`](#{one.translate(_SLUG)})"
                 for one in dict.fromkeys(self.places[below] for below in key.below))
        return f"{', '.join(links)}{_star(key)}"

    def _entry(self, key):
        """Return name, default with unit and bounds, else type, and meaning of a key."""
        meaning = _escaped(key.meaning)
        if key.below:
            return f"- **{key.name}** {self.linked(key)}: {meaning}"
        value = re.sub(r"(?<=[≥>≤<×]) | (?=×)", "", _escaped(key.value))
        unit = f" [{key.unit}]" if key.unit else ""
        if key.default == "required":
            said = '"' in value and all(one in key.meaning for one in value.split(", "))
            value = "" if said else f"{value}{unit}"
        elif key.default:
            others = [one for one in value.split(", ") if one != key.default]
            said = value == "boolean" or key.default[0] == "[" or all(
                one in key.meaning for one in others)
            bounds = "" if said else ", ".join(others).removeprefix("number").strip()
            value = f"`{key.default}`{unit}{bounds and f', {bounds}'}"
        else:
            value += unit
        value = re.sub(r"^number (?=[≥>])", "", re.sub(r"list: (number|string)", r"\1s", value))
        return f"- **{key.name}**{_star(key)}{value and f' ({value})'}: {meaning}"


def _same(key):
    return key.name, key.value, key.unit, key.meaning


def _star(key):
    return r"\*" if key.default == "required" else ""


def _escaped(text):
    return text.replace("<", r"\<").replace("*", r"\*").replace("|", r"\|")


if __name__ == "__main__":
    PAGE.write_text(written(), encoding="utf-8")
