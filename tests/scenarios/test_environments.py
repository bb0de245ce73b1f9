"""A command ends well where streams, names and disks are not as usual, and keeps what has run."""

import json
import os
import subprocess
import sys
import tempfile

import pytest

from scenarios import load, load_run, simulate
from scenarios.cli import doctor
from scenarios.cli.main import run_command
from scenarios.files import OutputError, claim, slug
from scenarios.measure import run_folder

COMMAND = [sys.executable, "-c", "from scenarios.cli.start import main; main()"]
RUN = [*COMMAND, "run", "ellipse", "--duration", "0.02", "--out", "a"]


def test_a_terminal_that_cannot_show_a_character_gets_a_replacement(tmp_path):
    done = subprocess.run(RUN, cwd=tmp_path, capture_output=True, check=False,
                          env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"20 ticks in a" in done.stdout


@pytest.mark.parametrize("closed", ["1>&-", "0<&- 1>&- 2>&-"])
def test_closed_streams_cost_no_run(closed, tmp_path):
    done = subprocess.run(["sh", "-c", f'"$@" {closed}', "sh", *RUN], cwd=tmp_path, check=False,
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    assert done.returncode == 0
    assert load_run(tmp_path / "a").ticks == 20


@pytest.mark.parametrize("name", ["x" * 300, "loop", "loop/a", "file/a"])
def test_a_folder_that_cannot_be_made_is_said_before_the_run(name, tmp_path):
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="cannot be written"):
        claim(tmp_path / name)


def test_names_of_settings_that_differ_late_give_different_folders():
    one, other = (slug(f"tpm:damping=0.{'0' * 300}{digit}") for digit in "12")
    assert one != other
    assert max(len(one), len(other)) <= 200


def test_an_interruption_that_breaks_the_compiler_is_still_an_interruption(tmp_path):
    code = ("import os, signal; from scenarios.cli import doctor, start\n"
            "def broken(_):\n"
            "    try:\n"
            "        os.kill(os.getpid(), signal.SIGTERM)\n"
            "    except KeyboardInterrupt:\n"
            "        raise RuntimeError('no compiled object yet') from None\n"
            "doctor.doctor_command = broken; start.main()")
    done = subprocess.run([sys.executable, "-c", code, "doctor"], cwd=tmp_path, text=True,
                          capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (130, "hierarchy: interrupted\n")


def test_the_doctor_finds_all_well_here(capsys):
    assert run_command(["doctor"]) == 0
    out = capsys.readouterr().out
    assert "No problems found." in out
    assert "20 of 20 answers certified" in out
    assert "200 ticks of ellipse" in out


def test_what_does_not_work_is_named_and_ends_with_1(monkeypatch, capsys):
    def broken():
        raise RuntimeError("no such kernel")

    monkeypatch.setattr(doctor, "_resolvers_agree", broken)
    assert run_command(["doctor", "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["well"] is False
    bad = [one for one in said["findings"] if one["well"] is False]
    assert [one["what"] for one in bad] == ["resolvers agree"]
    assert "RuntimeError: no such kernel" in bad[0]["found"]


def test_a_run_that_cannot_be_saved_where_it_should_is_saved_elsewhere(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (tmp_path / "file").touch()
    said = run_folder.kept(simulate(load("ellipse", ["control.duration=0.02"])),
                           tmp_path / "file")
    assert "cannot be written" in said
    assert load_run(said.partition("the run is in ")[2]).ticks == 20
