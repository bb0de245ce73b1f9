"""The documentation builds without a warning, is whole, and needs no network to be read."""

import importlib
import pkgutil
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from sphinx.util.inventory import InventoryFile

import hierarchy
import scenarios
import solvers
from hierarchy.tasks import TASKS
from scenarios.config import shipped

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(str(path.relative_to(DOCS).with_suffix("")) for path in DOCS.rglob("*.md")
               if "_build" not in path.parts)
LARGEST = 60_000  # bytes of a picture of the gallery


class Page(HTMLParser):
    """What a page points at, what it loads, and the places in it."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loads, self.ids = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids.add(found.get("id"))
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        elif "src" in found or tag == "link":
            self.loads.append(found.get("src") or found["href"])


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built pages by path; any warning is an error."""
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html",
         "-d", str(tmp_path_factory.mktemp("doctrees")), str(DOCS), str(out)],
        capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return {path.resolve(): Page(path) for path in out.rglob("*.html")}


def leads_to(path, link):
    """The file and the place in it that a link of a page leads to; None for one elsewhere."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return None
    return ((path.parent / unquote(parts.path)).resolve() if parts.path else path,
            unquote(parts.fragment))


def root_of(site):
    return min((path.parent for path in site), key=lambda folder: len(folder.parts))


def test_every_page_can_be_reached_from_the_index(site):
    root = root_of(site)
    waiting, reached = [root / "index.html"], set()
    while waiting:
        path = waiting.pop()
        if path in reached or path not in site:
            continue
        reached.add(path)
        found = (leads_to(path, link) for link in site[path].links)
        waiting += [place[0] for place in found if place]
    unreached = [page for page in PAGES if root / f"{page}.html" not in reached]
    assert unreached == [], "list them in docs/index.md"


def test_no_link_inside_the_site_is_broken(site):
    broken = []
    for path, page in site.items():
        for link in [*page.links, *page.loads]:
            place = leads_to(path, link)
            if place is None or link == "#":
                continue
            file, fragment = place
            if not file.exists() or (fragment and file in site and fragment not in site[file].ids):
                broken.append((path.name, link))
    assert broken == []


def test_nothing_is_loaded_from_a_network(site):
    loaded = {link for page in site.values() for link in page.loads}
    assert [link for link in loaded if urlsplit(link).netloc] == []
    for style in root_of(site).rglob("*.css"):
        assert not re.search(r"(url\(|@import)\s*['\"]?(https?:)?//", style.read_text()), style


def test_every_public_name_is_in_the_reference(site):
    with (root_of(site) / "objects.inv").open("rb") as file:
        known = InventoryFile.load(file, "", str.__add__)
    described = {name for kind, objects in known.items() if kind.startswith("py:")
                 for name in objects}
    missing = [" or ".join(names) for names in public_names() if not described & names]
    assert missing == [], "add their module to a page of docs/api"


def public_names():
    """The names of what the packages export, but for plain values: there, and where it is from."""
    for package in (hierarchy, solvers, scenarios):
        for name in [package.__name__, *(found.name for found in pkgutil.iter_modules(
                package.__path__, f"{package.__name__}.") if found.ispkg)]:
            module = importlib.import_module(name)
            for exported in getattr(module, "__all__", ()):
                value = getattr(module, exported)
                if hasattr(value, "__qualname__"):
                    yield {f"{name}.{exported}", f"{value.__module__}.{value.__qualname__}"}


@pytest.mark.parametrize("name", solvers.names())
def test_every_resolver_has_a_page_of_theory_with_an_example(name):
    page = DOCS / "theory" / f"{name}.md"
    assert page.exists(), f"write {page.relative_to(ROOT)}"
    text = page.read_text(encoding="utf-8")
    assert f'make("{name}"' in text or f'("{name}", ' in text
    assert "assert " in text
    assert f"`{name}`" in (DOCS / "choosing.md").read_text(encoding="utf-8")


def test_every_task_has_a_row():
    text = (DOCS / "tasks.md").read_text(encoding="utf-8")
    assert [name for name, task in TASKS.items()
            if f"\n| {name} | `{task.__name__}` |" not in text] == [], "add a row to docs/tasks.md"


@pytest.mark.parametrize("name", shipped())
def test_every_scenario_is_in_the_gallery_with_a_picture(name):
    text = (DOCS / "gallery.md").read_text(encoding="utf-8")
    picture = DOCS / "images" / "gallery" / f"{name}.png"
    section = f"\n## {name}\n\n![{name}](images/gallery/{name}.png)\n"
    shown = picture.exists() and text.count(section) == 1
    assert shown, (f"run `python -m benchmark.studies.gallery {name}` and give it a section in "
                   "docs/gallery.md, as the others have it")
    assert picture.stat().st_size < LARGEST
