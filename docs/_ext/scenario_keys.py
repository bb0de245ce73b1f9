"""The keys of a scenario file as tables, made from the form that the program checks files against.

A page that has the line `<!-- keys of a scenario file -->` gets them there.
"""

import json

MARK = "<!-- keys of a scenario file -->"


def setup(app):
    """Fill in the mark before the page is parsed."""
    app.connect("source-read", _fill)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _fill(app, docname, source):
    if MARK in source[0]:
        from scenarios.config import Scenario

        source[0] = source[0].replace(MARK, Keys(Scenario.model_json_schema()).text())


class Keys:
    """Walks a JSON schema from its root; every section comes where its key was met first."""

    def __init__(self, schema):
        self.known, self.root = schema["$defs"], schema
        self.places = {}  # of the sections met so far, by their name in the schema

    def text(self):
        """Return the sections as Markdown."""
        parts, done = [self._section("Top of the file", self.root, "")], set()
        while waiting := [name for name in self.places if name not in done]:
            for name in waiting:
                done.add(name)
                parts.append(self._section(*self._titled(name), self.places[name].strip("[]")))
        return "\n".join(parts)

    def _titled(self, name):
        section = self.known[name]
        kind = section["properties"].get("kind", {})
        chosen = f" with kind = {json.dumps(kind['const'])}" if "const" in kind else ""
        return f"`{self.places[name]}`{chosen}", section

    def _section(self, title, section, place):
        rows = [f"| `{key}` | {self._kind(value, f'{place}.{key}'.lstrip('.'))} | "
                f"{self._default(section, key, value)} |"
                for key, value in section["properties"].items()]
        text = section["description"].replace("<", r"\<").replace("*", r"\*")
        head = "\n| key | what | default |\n|---|---|---|"
        return "\n".join([f"## {title}\n", text, head, *rows, ""])

    def _default(self, section, key, value):
        if key in section.get("required", ()):
            return "must be given"
        default = value.get("default")
        nothing = default in (None, []) or isinstance(default, dict)
        return "" if nothing else f"`{json.dumps(default)}`"

    def _kind(self, value, place):
        if "$ref" in value:
            return self._reference(value["$ref"].rpartition("/")[2], place)
        several = value.get("anyOf") or value.get("oneOf")
        if several:
            kinds = [self._kind(one, place) for one in several if one.get("type") != "null"]
            return " or ".join(dict.fromkeys(kinds))
        if "const" in value or "enum" in value:
            chosen = value.get("enum", [value.get("const")])
            return ", ".join(f"`{json.dumps(one)}`" for one in chosen)
        return self._plain(value, place)

    def _plain(self, value, place):
        kind = value.get("type")
        if kind == "array" and "prefixItems" in value:
            entries = value["prefixItems"]
            return f"{len(entries)} × {self._kind(entries[0], place)}"
        if kind == "array":
            return f"list: {self._kind(value.get('items', {}), f'[{place}]')}"
        unit = f" [{value['unit']}]" if "unit" in value else ""
        bounds = [f" {sign} {value[name]:g}" for name, sign in
                  (("minimum", "≥"), ("exclusiveMinimum", "\\>"), ("maximum", "≤"),
                   ("exclusiveMaximum", "\\<")) if name in value]
        return {"string": "text", "boolean": "true or false", "integer": "whole number",
                "object": "table"}.get(kind, "number") + unit + ",".join(bounds)

    def _reference(self, name, place):
        if "properties" not in self.known[name]:
            return self._kind(self.known[name], place)
        self.places.setdefault(name, f"[{place}]")
        return f"`{self.places[name]}`"
