"""What the documents show works as printed: Python, scenario files, commands."""

import importlib.util
import re
import shlex
import tomllib
from pathlib import Path

import pytest
import typer

from hierarchy.robots import TABLES
from hierarchy.tasks import TASKS
from scenarios.cli.main import app, run_command
from scenarios.config import load, members
from scenarios.results.plan import load_sweep

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```", re.DOTALL | re.MULTILINE)
INLINE = re.compile(r"(?<!`)`((?:hierarchy |make |python -m |python docs/)[^`]+)`(?!`)")
TEXTS = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
         for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md",
                      *sorted(path for path in (ROOT / "docs").rglob("*.md")
                              if "_build" not in path.parts)]}
FENCE = re.compile(r"^(\s*)```(.*)$", re.MULTILINE)
CHECKED = {"", "python", "toml", "sh", "console", "bash", "c"}  # c: test_library_programs.py
OF_THE_SITE = {"{toctree}", "{eval-rst}"}
FOLLOWED = "docs/tutorial.md", "docs/urdf-to-standing.md"  # whose commands are run, not only read
COMMANDS = typer.main.get_command(app).commands


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
            for indent, language in FENCE.findall(text)
            if indent.strip("\n") or language not in CHECKED | OF_THE_SITE] == []


@pytest.mark.parametrize("name", having(
    lambda name: name not in FOLLOWED and blocks(name, "python")))
def test_the_code_of_a_document_runs(name):
    """Later blocks go on from earlier ones."""
    exec(compile("\n".join(blocks(name, "python")), name, "exec"), {"__name__": "document"})


@pytest.mark.parametrize("name", having(
    lambda name: name not in FOLLOWED and blocks(name, "toml")))
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
    found = COMMANDS[command]
    if command == "bench" and arguments and not arguments[0].startswith("-"):
        found, arguments = found.commands[arguments[0]], arguments[1:]
    if all(word.startswith("-") for word in arguments):  # a command that is only mentioned
        assert set(arguments) <= {opt for one in found.params for opt in one.opts}
        return
    asked = found.make_context(command, list(arguments)).params
    named = [*asked.get("scenarios", ()), asked.get("scenario"), asked.get("file")]
    specs = [asked.get("resolver"), *(asked.get("resolvers") or "").split(",")]
    for name in members(filter(is_name, named)):
        if command == "sweep":
            load_sweep(name)
            continue
        scenario = load(name, asked.get("changes") or [])
        for spec in specs:
            if spec and not spec.isupper():
                scenario.with_resolver(spec)


def is_name(text):
    """Whether it names something shipped: no path, no robot of a package, no placeholder FILE."""
    return bool(text) and not set("./:") & set(text) and not text.isupper()


@pytest.mark.parametrize("document", FOLLOWED)
def test_a_tutorial_can_be_followed_from_top_to_bottom(document, tmp_path):
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
