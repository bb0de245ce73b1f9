"""Commands: what they write, and how they end where something is not as usual."""

import json
import os
import signal
import subprocess
import sys
import tempfile
from unittest import mock

import pytest
from hand_made import recording

from scenarios import compare, load, load_run, simulate
from scenarios.cli import doctor
from scenarios.cli.main import app
from scenarios.files import OutputError, claim, in_runs, slug
from scenarios.measure import run_folder
from scenarios.results import comparing
from scenarios.results.store import FullError


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def stands_in(instead, monkeypatch):
    """Take the place of `simulate` where runs are made, and where they are compared."""
    for module in ("scenarios.loop.simulation", "scenarios.results.comparing"):
        monkeypatch.setattr(f"{module}.simulate", instead)


def test_one_run_that_breaks_does_not_lose_the_others(tmp_path, monkeypatch, command, undrawn):
    def breaks_under_recursive(scenario, progress=None):
        if scenario.control.resolver == "recursive":
            raise ArithmeticError("[bold]no[/bold] answer")
        return recording(scenario)

    stands_in(breaks_under_recursive, monkeypatch)
    done = compare("ellipse", ["recursive", "tpm"], out=tmp_path / "b")
    assert [run.fault for run in done.runs] == ["ArithmeticError: [bold]no[/bold] answer", None]
    monkeypatch.setenv("HOME", str(tmp_path))
    command("replay ~/b")
    assert (tmp_path / "b" / "replay.html").exists()
    command("replay b --out=~/own.html")  # was a folder called ~
    assert (tmp_path / "own.html").exists()
    assert "the path is empty" in command("view ''", code=2).err  # was the working directory
    assert "no file can be called" in command("replay", "x" * 300, code=2).err
    said = command("compare ellipse --resolvers recursive,tpm --workers 1 --out c", code=1).err
    assert "[bold]no[/bold] answer" in said


def ended(code, folder, *words):
    """The process of a command that runs behind a line of code."""
    code = f"import os, signal; {code}from scenarios.cli.start import main; main()"
    return subprocess.run([sys.executable, "-c", code, *words], cwd=folder, capture_output=True,
                          text=True, check=False)


@pytest.mark.parametrize(("words", "folder", "code"), [
    ("run ellipse", "a", 1),
    ("compare ellipse --resolvers tpm,hcod --workers 1", "a/ellipse/tpm", 130)])
def test_a_signal_in_the_middle_of_a_run_saves_every_tick_so_far_whole(
        words, folder, code, tmp_path):
    done = ended("""import contextlib, scenarios.cli.terminal as terminal
terminal.bar = lambda *_: contextlib.nullcontext(
    lambda label, done, total: done == 500 and os.kill(os.getpid(), signal.SIGTERM))
""", tmp_path, *words.split(), "--duration", "20", "--out", "a")
    assert done.returncode == code
    run = load_run(tmp_path / folder)
    assert 500 <= run.ticks < 20_000
    assert run.fault == f"interrupted at tick {run.ticks}"
    assert run.fault in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def write_and_interrupt(*given, write=comparing._so_far):
    write(*given)
    raise KeyboardInterrupt


@pytest.mark.parametrize(("instead", "workers", "code", "said", "runs", "files"), [
    ({"simulate": mock.Mock(side_effect=KeyboardInterrupt)}, 1, 130, "interrupted", 0, ()),
    ({"simulate": lambda run, **_: recording(run, fault="interrupted at tick 3")}, 2, 130,
     "the runs made so far are in b", 2, ()),
    ({"comparing.write_table": mock.Mock(side_effect=FullError("full"))}, 1, 1,
     "FullError: full; the runs are in b", 2, ()),
    ({"comparing._so_far": write_and_interrupt}, 2, 130, "the runs made so far are in b", 1,
     ("results.csv", "index.html", "comparison.json")),
    ({"comparing._so_far": write_and_interrupt,
      "page.comparison_page": mock.Mock(side_effect=ArithmeticError)}, 1, 130,
     "the runs made so far are in b", 1, ("results.csv",))],
    ids=["before the first tick", "while runs are timed", "no room for the table",
         "after a run", "and the page breaks"])
def test_a_comparison_that_ends_early_keeps_the_runs_that_ended_and_no_empty_folder(
        instead, workers, code, said, runs, files, tmp_path, monkeypatch, command, undrawn):
    for name, one in instead.items():
        if name == "simulate":
            stands_in(one, monkeypatch)
        else:
            monkeypatch.setattr(f"scenarios.results.{name}", one)
    told = command("compare ellipse --resolvers tpm,hcod --duration 0.02 --out b --workers",
                   workers, code=code).err
    assert f"{said}\n" in told
    assert len([*tmp_path.rglob("run.npz")]) >= runs
    assert (tmp_path / "b").exists() == ("runs" in told) == (runs > 0)
    assert {*files} <= {path.name for path in (tmp_path / "b").glob("*")}


def test_the_shell_completes_commands_scenarios_and_resolvers(monkeypatch, capsys):
    def completed(*words):
        """What bash would offer for the last of the words of a command line."""
        monkeypatch.setenv("_HIERARCHY_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", " ".join(words))
        monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
        with pytest.raises(SystemExit):
            app(prog_name="hierarchy")
        return capsys.readouterr().out.split()

    assert completed("hierarchy", "comp") == ["compare"]
    assert completed("hierarchy", "compare", "ladder")[-1] == "ladder"
    assert completed("hierarchy", "compare", "ellipse", "--resolvers", "tpm,hc") == ["tpm,hcod"]
    assert completed("hierarchy", "sweep", "ell") == ["ellipse-starts"]


def test_ctrl_c_while_it_is_starting_ends_the_command_quietly(tmp_path):
    done = ended("import sys; from scenarios.cli import start; sys.meta_path.insert(0, type("
                 "'Held', (), {'find_spec': lambda *_: os.kill(os.getpid(), signal.SIGINT)})); ",
                 tmp_path, "list")
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


@pytest.mark.parametrize(("error", "code", "said"), [
    (KeyboardInterrupt(), 130, "hierarchy: interrupted\n"),
    (OSError(28, "No space left on device", "a/file"), 1,
     "hierarchy: fault: a/file: No space left on device\n")])
def test_a_command_that_is_interrupted_or_refused_ends_without_a_traceback(
        error, code, said, monkeypatch, command):
    monkeypatch.setattr("scenarios.cli.doctor.doctor_command", mock.Mock(side_effect=error))
    assert command("doctor", code=code).err == said


@pytest.mark.parametrize(("closed", "out"), [("0<&-", b"20 ticks in a"), ("1>&- 2>&-", b"")])
def test_closed_streams_and_a_terminal_that_cannot_show_a_character_cost_no_run(
        closed, out, tmp_path):
    done = subprocess.run(
        ["sh", "-c", f'"$@" {closed}', "sh", sys.executable, "-m", "scenarios.cli.start", "run",
         "ellipse", "--duration", "0.02", "--out", "a"], cwd=tmp_path, capture_output=True,
        check=False, env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr, load_run(tmp_path / "a").ticks) == (0, b"", 20)
    assert out in done.stdout


@pytest.mark.parametrize("name", ["x" * 300, "loop", "loop/a", "file/a"])
def test_a_folder_that_cannot_be_made_is_said_before_the_run(name, tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be written"):
        claim(tmp_path / name)


def test_an_unknown_user_in_a_path_is_the_name_of_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert claim("~nobody of this name/a") == tmp_path / "~nobody of this name" / "a"


def test_names_of_settings_that_differ_late_give_different_folders():
    one, other = (slug(f"tpm:damping=0.{'0' * 300}{digit}") for digit in "12")
    assert one != other
    assert slug("weighted:strict_levels=1") != slug("weighted:strict_levels=-1")
    assert max(len(one), len(other)) <= 200
    assert len(f"{in_runs(100 * '日').name}-2".encode()) <= 255


@pytest.mark.parametrize("dropped", ["""try:
        os.kill(os.getpid(), signal.SIGTERM)
    except KeyboardInterrupt:
        raise RuntimeError('no compiled object yet') from None
""", """import ctypes, time
    ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGTERM))()
    time.sleep(600)
"""], ids=["and breaks", "and goes on"])
def test_an_interruption_that_the_compiler_drops_is_still_an_interruption(dropped, tmp_path):
    done = ended(f"""from scenarios.cli import doctor
def compiling(_):
    {dropped}
doctor.doctor_command = compiling
""", tmp_path, "doctor")
    assert (done.returncode, done.stderr) == (130, "hierarchy: interrupted\n")


def test_the_doctor_finds_all_well_here(command):
    out = command("doctor").out
    for line in ("No problems found.", "  ok  python ", "20 of 20 answers", "200 ticks of ellipse"):
        assert line in out


@pytest.mark.parametrize(("name", "instead", "found"), [
    ("_resolvers_agree", mock.Mock(side_effect=RuntimeError("no such kernel")), "RuntimeError: no"),
    ("_MET", 0.0, "20 of 20 answers")])
def test_what_does_not_work_is_named_and_ends_with_1(name, instead, found, monkeypatch, command):
    monkeypatch.setattr(doctor, name, instead)
    said = json.loads(command("doctor --json", code=1).out)
    assert said["well"] is False
    bad = [one for one in said["findings"] if one["well"] is False]
    assert [one["what"] for one in bad] == ["resolvers agree"]
    assert found in bad[0]["found"]


def test_a_run_that_cannot_be_saved_where_it_should_is_saved_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    said = run_folder.kept(simulate(load("ellipse", ["control.duration=0.02"])), tmp_path / "file")
    assert "cannot be written" in said
    assert load_run(said.partition("the run is in ")[2]).ticks == 20
    monkeypatch.setattr(run_folder, "save", mock.Mock(side_effect=OutputError("full")))
    assert run_folder.kept(mock.Mock(), tmp_path / "run") == "full; full"
