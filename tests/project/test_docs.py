"""The documentation is whole, and what documents show works as printed."""

import importlib
import importlib.util
import pkgutil
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import typer
from sphinx.util.inventory import InventoryFile

import hierarchy
import scenarios
import solvers
from hierarchy.robots import TABLES
from hierarchy.tasks import TASKS
from scenarios.cli.main import app, run_command
from scenarios.config import load, members, shipped
from scenarios.results.plan import load_sweep

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site; any warning is an error, such as a link that leads nowhere."""
    out = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html",
         "-d", str(tmp_path_factory.mktemp("doctrees")), str(DOCS), str(out)],
        capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out


def test_nothing_of_the_site_is_loaded_from_a_network(site):
    for file in (*site.rglob("*.html"), *site.rglob("*.css")):
        loads = r"""(url\(|@import|<link [^>]*href=|<[^a][^>]* src=)\s*['"]?(https?:)?//"""
        assert not re.search(loads, file.read_text()), file


def test_every_public_name_is_in_the_reference(site):
    with (site / "objects.inv").open("rb") as file:
        known = InventoryFile.load(file, "", str.__add__)
    described = {name for kind, objects in known.items() if kind.startswith("py:")
                 for name in objects}
    missing = [" or ".join(names) for names in public_names() if not described & names]
    assert missing == [], "add their module to a page of docs/api"
    text = "".join(path.read_text() for path in (site / "api").glob("*.html"))
    assert " at 0x" not in text, "a signature has an object in place of a type"


def test_the_help_of_every_command_and_of_those_below_it_is_on_one_page(site):
    page = (site / "commands.html").read_text()
    for command in ("run", "problems export", "bench open"):
        assert f"Usage: hierarchy {command} " in page


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
    assert picture.stat().st_size < 60_000  # bytes


BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<!`)`((?:hierarchy |make |python -m |python docs/)[^`]+)`(?!`)")
TEXTS = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
         for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]}
CHECKED = {"", "python", "toml", "sh", "console", "bash", "c"}  # c: test_library_programs.py
FOLLOWED = "docs/tutorial.md", "docs/urdf-to-standing.md"  # whose commands are run, not only read


def blocks(name, *languages):
    """The blocks of a document in these languages, in order."""
    return [text for language, text in BLOCK.findall(TEXTS[name]) if language in languages]


def commands(name):
    """The command lines of a document: of its shell blocks and of its running text."""
    shell = "\n".join(blocks(name, "", "sh", "console", "bash")).replace("\\\n", " ")
    lines = [line.strip().removeprefix("$ ") for line in shell.splitlines()]
    prose = [" ".join(text.split()) for text in INLINE.findall(BLOCK.sub("", TEXTS[name]))]
    return [re.split(r"\s{2,}| #", line)[0] for line in [*lines, *prose]
            if re.match(r"((hierarchy|make|python -m|pip install) [a-z'\".-]|python docs/)", line)]


def having(found):
    return [name for name in TEXTS if found(name)]


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path, monkeypatch, no_plugins):
    """What a document writes or registers is gone after it."""
    monkeypatch.chdir(tmp_path)
    kept = [(registry, dict(registry)) for registry in (TABLES, TASKS)]
    yield
    for registry, before in kept:
        registry.clear()
        registry.update(before)


def test_no_block_of_a_document_escapes_these_tests():
    assert [(name, indent, language) for name, text in TEXTS.items()
            for indent, language in re.findall(r"^(\s*)```(.*)$", text, re.MULTILINE)
            if indent.strip("\n") or language not in CHECKED | {"{toctree}", "{eval-rst}"}] == []


@pytest.mark.parametrize("name", having(
    lambda name: name not in FOLLOWED and blocks(name, "python")))
def test_the_code_of_a_document_runs(name):
    """Later blocks go on from earlier ones."""
    exec(compile("\n".join(blocks(name, "python")), name, "exec"), {"__name__": "document"})


@pytest.mark.parametrize("name", having(lambda name: name not in FOLLOWED and blocks(name, "toml")))
def test_the_files_that_a_document_shows_can_be_read(name, tmp_path):
    (tmp_path / "my-scenario.toml").write_text('extends = "ellipse"\nname = "my-scenario"\n')
    for i, text in enumerate(blocks(name, "toml")):
        data, file = tomllib.loads(text), tmp_path / f"block-{i}.toml"
        file.write_text(text)
        if "scenarios" in data:
            load_sweep(file)
        elif "name" in data and ({"robot", "extends"} & set(data)):
            load(file)


@pytest.mark.parametrize("name", having(commands))
def test_the_commands_of_a_document_exist(name):
    if any("--plugin my_module" in command for command in commands(name)):
        exec(compile("\n".join(blocks(name, "python")), name, "exec"), {"__name__": "document"})
    for command in commands(name):
        check(shlex.split(command))


def check(words):
    """One command line: its name, options, scenarios and resolvers are known."""
    first, second, *rest = words
    if first == "hierarchy":
        check_hierarchy(second, rest)
    elif first == "make":
        for target in (word for word in words[1:] if "=" not in word):
            assert f"\n{target}:" in (ROOT / "Makefile").read_text(), words
    elif first == "python":
        assert importlib.util.find_spec(rest[0]) if second == "-m" else (ROOT / second).is_file()
    else:
        extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
            "optional-dependencies"]
        for extra in re.findall(r"(?:task-hierarchy|\.)\[([^\]]+)\]", " ".join(words)):
            assert set(extra.split(",")) <= set(extras), words


def check_hierarchy(command, arguments):
    if command.startswith("-"):
        return
    found = typer.main.get_command(app).commands[command]
    if command == "bench" and arguments and not arguments[0].startswith("-"):
        found, arguments = found.commands[arguments[0]], arguments[1:]
    if all(word.startswith("-") for word in arguments):  # a command that is only mentioned
        assert set(arguments) <= {opt for one in found.params for opt in one.opts}
        return
    asked = found.make_context(command, list(arguments)).params
    named = [*asked.get("scenarios", ()), asked.get("scenario"), asked.get("file")]
    specs = [asked.get("resolver"), *(asked.get("resolvers") or "").split(",")]
    for name in members(text for text in named if text and not set("./:") & set(text)
                        and not text.isupper()):  # shipped: no path, robot or placeholder FILE
        if command == "sweep":
            load_sweep(name)
            continue
        scenario = load(name, asked.get("changes") or [])
        for spec in specs:
            if spec and not spec.isupper():
                scenario.with_resolver(spec)


@pytest.mark.parametrize("document", FOLLOWED)
def test_a_tutorial_can_be_followed_from_top_to_bottom(document, tmp_path, undrawn):
    """Files get the name in their first line, commands are run, Python goes on."""
    if "standing" in document:
        pytest.importorskip("mujoco")
    names, followed = {"__name__": "document"}, set()
    for language, text in BLOCK.findall(TEXTS[document]):
        followed.add(language)
        if language == "toml":
            (tmp_path / text.splitlines()[0].removeprefix("# ")).write_text(text)
        elif language == "python":
            exec(compile(text, document, "exec"), names)
        elif language == "sh":
            for line in text.splitlines():
                if line.startswith("hierarchy "):
                    assert run_command(shlex.split(line, comments=True)[1:]) == 0, line
    assert followed >= {"toml", "python", "sh"}
