"""Sampled runs are made once each, whatever is killed on the way, and compared sample by sample."""

import csv
import json
import os
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest
from deadly import dies_of_one
from refusals import refused
from scipy.stats import PermutationMethod, wilcoxon

from scenarios import load, shipped, simulate
from scenarios.measure import metrics
from scenarios.measure.statistics import EXACT, paired
from scenarios.results import plan as plan_of
from scenarios.results import pool
from scenarios.results.plan import Job, Outcome, load_sweep, outcome, plan, shipped_sweeps
from scenarios.results.sampled import Workers, compare_starts, complete, sweep
from scenarios.results.store import FullError, Store

BODY = {"name": '"small"', "scenarios": '["ellipse"]', "resolvers": '["tpm", "recursive"]',
        "duration": "0.02", "samples": "3", "seed": "7"}
PARAMETERS = """
start.q = { around = 0.05 }
avoidance.obstacles.0.centre = { around = [0.01, 0.02, 0.0] }
"position.stiffness" = { uniform = [30.0, 50.0] }
position.damping = { normal = [20.0, 1.0] }
pointing.alpha_d = { choice = [5.0, 15.0] }
plant.measurement.seed = { integers = [3, 5] }
"""
SHORT = {"control.duration": 0.03}


def write(folder, parameters=PARAMETERS, **changed):
    body = "\n".join(f"{key} = {value}" for key, value in (BODY | changed).items())
    path = folder / "small.toml"
    path.write_text(f"{body}\n[parameters]\n{parameters}")
    return path


def table(file):
    """Return value and note of each row of a table by resolver, sample and metric."""
    with file.open() as stream:
        return {(row["resolver"], row["sample"], row["metric"]): (row["value"], row["note"])
                for row in csv.DictReader(stream) if not row["metric"].startswith("time_")
                and row["metric"] not in ("wall_seconds", "late_share")}


@pytest.mark.parametrize(("parameters", "changed", "says"), [
    ("", {"sampels": "3"}, "did you mean 'samples'"),
    ("", {"scenarios": '["elipse"]'}, "did you mean 'ellipse'"),
    ("", {"scenarios": '["ellipse", "ellipse"]'}, "2 scenarios are named 'ellipse'"),
    ("", {"resolvers": '["tpm:dampign=0.1"]'}, "dampign"),
    ("", {"duration": "-1.0"}, "duration: "),
    ("start.q = { arround = 0.1 }", {}, "unknown key 'parameters.start.q.arround'; did you mean "
     "'parameters.start.q.around'"),
    ("start.q = 3", {}, "parameters.start.q: expected one table"),
    ("start.q = { around = [0.1, 0.2] }", {}, "parameters.start.q: scenario 'ellipse': around"),
    ("position.gain = { uniform = [2.0, 1.0] }", {}, "parameters.position.gain.uniform: "),
    ("position.gian = { uniform = [1.0, 2.0] }", {}, "unknown key 'position.gian'; did you"),
    ('control.resolver = { choice = ["hqp", "sns"] }', {}, "control.resolver is drawn, but the"),
    ("limits.margin = { around = 0.1 }", {}, "limits.margin: scenario 'ellipse': [limits] is mi"),
    ("position.damping = { normal = [-9.0, 0.0] }", {}, "sample 0 of scenario 'ellipse'")])
def test_a_wrong_file_is_refused_before_anything_is_run(parameters, changed, says, tmp_path,
                                                        command):
    path = write(tmp_path, parameters, **changed)
    assert says in command("sweep", path, "--out", tmp_path / "out", code=2).err
    assert list(tmp_path.iterdir()) == [path]


def test_a_scenario_is_no_sweep_and_a_file_with_neither_is_an_incomplete_one(tmp_path):
    path = tmp_path / "one.toml"
    for text, said in ((b'extends = "ellipse"', "is a scenario, to be run by"),
                       (b'name = "one"', "samples: Field required"), (b"\xff", "is not UTF-8")):
        path.write_bytes(text)
        refused(said, load_sweep, path)
        refused(said, sweep, path, tmp_path / "out")


def test_every_shipped_sweep_can_be_planned_and_every_scenario_varies():
    for name in shipped_sweeps():
        small = load_sweep(name).model_copy(update={"samples": 2})
        assert len(plan(small).runs) == 2 * len(small.resolvers) * len(small.scenarios)
    for scenario in map(load, shipped()):
        first, second = (scenario.drawn(0, index) for index in range(2))
        assert first != second


def test_runs_are_made_again_after_a_file_that_they_read_has_changed(tmp_path):
    """A motion that the scenario names, a file that the robot's file includes."""
    motion, robot, keys, digests = tmp_path / "motion.csv", tmp_path / "whole.xml", [], []
    path = f"position.path={{kind='recorded', file='{motion}'}}"
    robot.write_text('<mujoco><worldbody><include file="part.xml"/></worldbody></mujoco>')
    for value in "115":
        motion.write_text(f"t,x,y,z\n0,0,0.6,0.1\n1,0,0.6,0.{value}\n")
        planned = plan(load_sweep(write(tmp_path, "")), [load("ellipse", [path])])
        keys.append({one.key for one in planned.runs})
        (tmp_path / "part.xml").write_text(f'<mujocoinclude><geom size="1" mass="{value}"/></>')
        digests.append(plan_of._content(str(robot)))
    assert keys[0] == keys[1]
    assert not keys[0] & keys[2]
    assert digests[0] == digests[1] != digests[2]


def test_the_rows_are_the_same_in_processes_in_parts_and_on_a_cluster(tmp_path, command, undrawn):
    distributed = pytest.importorskip("distributed", reason="needs the extra sweep")
    sweep = "sweep", write(tmp_path), "--out"
    command(*sweep, tmp_path / "a", "--workers", 2)
    for part in ("1/2", "2/2"):
        command(*sweep, tmp_path / "b", "--part", part, "--workers", 1)
    assert not (tmp_path / "b" / "results.csv").exists()
    command(*sweep, tmp_path / "b", "--scheduler", "tcp://127.0.0.1:1")
    command(*sweep, tmp_path / "d", "--scheduler", "nowhere://", code=2)
    assert not (tmp_path / "d").exists()
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False,
                                  protocol="tcp", dashboard_address=None) as one:
        command(*sweep, tmp_path / "c", "--scheduler", one.scheduler_address)
    first, second, third = (table(tmp_path / out / "results.csv") for out in "abc")
    assert first == second == third
    assert sum(metric == "reached_end" for _, _, metric in first) == 6
    assert ("tpm", "2", "start.q.6") in first


@pytest.mark.parametrize("seed", range(5))
def test_the_p_value_is_that_of_all_signs_with_and_without_ties(seed):
    random = np.random.default_rng(seed)
    first = random.normal(size=9)
    second = first + 0.4 + random.normal(size=9)
    assert paired(first, second).p == pytest.approx(wilcoxon(second - first, method="exact")[1])
    second = np.random.default_rng(seed).integers(-2, 5, 11).astype(float)
    assert paired(np.zeros(11), second).p == pytest.approx(wilcoxon(
        second[second != 0.0], method=PermutationMethod(n_resamples=np.inf))[1])
    for count, method in ((EXACT, "exact"), (EXACT + 1, "asymptotic")):
        apart = 0.2 + random.normal(size=count)
        assert paired(np.zeros(count), apart).p == pytest.approx(wilcoxon(apart, method=method)[1])
        counts = random.integers(50, 900, count) + random.integers(0, 5, (2, count))
        assert paired(*counts / 1257.0).p == paired(*counts * 8.0).p  # shares tie to rounding


def test_a_run_that_kills_its_process_costs_only_itself(tmp_path, capfd):
    jobs = [Job(str(i), "", "deadly" if i == 2 else "tpm") for i in range(6)]
    store = Store(tmp_path / "out")
    with store.opened():
        assert complete(jobs, store, Workers(2), "deadly", work=dies_of_one) == 6
    said = {key: one.reason for key, one in store.outcomes().items()}
    killed = "Killed: every process that started this run died"
    assert said == {str(i): killed if i == 2 else None for i in range(6)}
    assert "Traceback" not in capfd.readouterr().err  # of a process without a standard input


def test_what_has_ended_at_ctrl_c_is_given_up_unless_it_is_asked_for(monkeypatch):
    all_at_once = pool.as_completed
    monkeypatch.setattr(pool, "as_completed", lambda made: [*all_at_once(made)])
    ended = pool.ended(len, ["a", "b"], 2)
    next(ended)
    with pytest.raises(KeyboardInterrupt):
        ended.throw(KeyboardInterrupt)


def test_rows_that_were_cut_off_are_made_again_and_a_full_disk_is_said(tmp_path, monkeypatch):
    store = Store(tmp_path / "out")
    speed = metrics.Metric("speed_max", "Joint speed, max", 1.5, "rad/s", note='"v", é')
    runs = {key: Outcome(key, 20, said, 0.1, (speed,))
            for key, said in (("a", None), ("b", 'broke,\n"é" once'), ("c", None))}
    odd = Outcome("d", 20, "broke\r\nin \udcff", 0.1)
    with Store(tmp_path / "odd").opened():
        Store(tmp_path / "odd").add(odd)
    with Store(tmp_path / "odd").opened():
        pass
    assert Store(tmp_path / "odd").outcomes() == {"d": odd}
    with store.opened():
        store.add(runs["a"])
        one = store.file.stat().st_size
        store.add(runs["b"])
        both = store.file.read_bytes()
    # In a line, in a character, before the end of the last line.
    for size in (9, *range(80, len(both), 80), both.rindex(b"u00e9") + 1, len(both) - 1):
        store.file.write_bytes(both[:size])
        kept = {"a": runs["a"]} if size >= one else {}
        assert store.outcomes() == kept
        with store.opened():
            store.add(runs["c"])
            assert store.outcomes() == {**kept, "c": runs["c"]}
    with store.opened():
        failed = outcome(mock.Mock(key="b", load=mock.Mock(side_effect=ValueError("broke"))))
        assert (failed.key, failed.ticks, failed.reason) == ("b", 0, "ValueError: broke")
        monkeypatch.setattr(os, "fsync", mock.Mock(side_effect=OSError(28, os.strerror(28))))
        with pytest.raises(FullError, match=r"out/runs/all\.jsonl cannot be written: No space"):
            store.add(Outcome("d", 20, None, 0.1))


def test_a_folder_in_use_or_of_something_else_is_refused(tmp_path):
    held = """import sys, time; from pathlib import Path; from scenarios.results.store import Store
with Store(Path(sys.argv[1])).opened(): print(flush=True); time.sleep(60)"""
    with subprocess.Popen([sys.executable, "-c", held, str(tmp_path / "a")],
                          stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        refused(f"process {process.pid} on ", lambda: Store(tmp_path / "a").opened().__enter__())
        process.kill()
    with Store(tmp_path / "a").opened():
        pass
    (tmp_path / "thesis.tex").touch()
    refused("not a sweep's", lambda: Store(tmp_path).opened().__enter__())


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("starts") / "out"
    with (mock.patch("scenarios.results.cluster.ended"),  # which needs another package
          mock.patch("scenarios.results.sampled_page.svg", lambda fig, title: title)):
        found = compare_starts([load("ellipse", SHORT)], ["recursive", "hcod", "augmented"], 7, 3,
                               folder, workers=Workers(1))
    return found, json.loads((folder / "results.json").read_text()), folder


def test_the_page_has_its_verdict_and_links_worst_runs_to_files_that_give_the_same(done):
    found, data, folder = done
    page = (folder / "index.html").read_text()
    assert all(line in page for line in data["groups"]["ellipse"]["verdict"])
    assert "± 0.02, uniform [rad or m]</li>" in page
    for (metric, *_), run in found.found["ellipse"].worst()[:3]:
        name = next(file for file in (folder / "worst").iterdir() if run.key[:6] in file.name)
        assert f"worst/{name.name}" in page
        assert metrics.measure(simulate(load(name)))[metric.name].value == metric.value
