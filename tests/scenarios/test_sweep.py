"""A sweep makes every run once, whatever is killed on the way, and says what came of each."""

import errno
import os
import signal
import subprocess
import sys
from collections import Counter
from contextlib import suppress

import numpy as np
import psutil
import pyarrow.parquet as parquet
import pytest
from deadly import dies_of_one

from hierarchy import HierarchyError
from scenarios import load, simulate
from scenarios.cli.main import run_command
from scenarios.config.sampling import drawn
from scenarios.measure import metrics
from scenarios.measure.statistics import wilson
from scenarios.sweep import engine, load_sweep, sweep
from scenarios.sweep.config import SweepError, shipped_sweeps
from scenarios.sweep.engine import carry_out, connected
from scenarios.sweep.planning import plan
from scenarios.sweep.run import Outcome, digest, run
from scenarios.sweep.store import FullError, Store, StoreError

pytestmark = pytest.mark.slow

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


def write(folder, parameters=PARAMETERS, **changed):
    body = "\n".join(f"{key} = {value}" for key, value in (BODY | changed).items())
    path = folder / "small.toml"
    path.write_text(f"{body}\n[parameters]\n{parameters}")
    return path


def rows(folder):
    return parquet.read_table(folder / "runs.parquet").to_pylist()


def timeless(row):
    """Return a row without what depends on how busy the machine is."""
    return {key: value for key, value in row.items()
            if not key.startswith("time_") and key not in ("wall_seconds", "ticks_late")}


def keys_kept(folder):
    return Counter(key for part in Store(folder).parts
                   for key in parquet.read_table(part)["key"].to_pylist())


# What is asked

@pytest.mark.parametrize(("parameters", "changed", "says"), [
    ("", {"sampels": "3"}, "did you mean 'samples'"),
    ("", {"samples": "0"}, "samples: "),
    ("", {"scenarios": '["elipse"]'}, "did you mean 'ellipse'"),
    ("", {"scenarios": '["ellipse", "ellipse"]'}, "2 scenarios are named 'ellipse'"),
    ("", {"scenarios": '["there.toml"]'}, "there.toml"),
    ("", {"resolvers": '["tmp"]'}, "did you mean 'tpm'"),
    ("", {"resolvers": '["tpm:dampign=0.1"]'}, "dampign"),
    ("", {"duration": "-1.0"}, "duration: "),
    ("start.q = { arround = 0.1 }", {},
     "parameters.start.q.arround: expected a table with one of uniform, normal"),
    ("start.q = 0.1", {}, "parameters.start.q: expected a table"),
    ("start.q = { around = -0.1 }", {}, "parameters.start.q.around: "),
    ("start.q = { around = 0.1, mean = 0.0 }", {}, "parameters.start.q.mean"),
    ("start.q = { around = [0.1, 0.2] }", {}, "parameters.start.q: scenario 'ellipse': around"),
    ("start.v = { around = 0.1 }", {}, "parameters.start.v: scenario 'ellipse': the scenario's own "
     "value is None, not a number"),
    ("position.gain = { uniform = [2.0, 1.0] }", {},
     "parameters.position.gain.uniform: 2 is above 1"),
    ("position.gian = { uniform = [1.0, 2.0] }", {}, "[position] has no key 'gian'; it has "),
    ("limits.margin = { uniform = [1.0, 2.0] }", {}, "[limits] is missing"),
    ("avoidance.obstacles.3.centre = { around = 0.1 }", {},
     "3 entries, numbered from 0, and no '3'"),
    ("position.damping = { normal = [-9.0, 0.0] }", {},
     "sample 0 of scenario 'ellipse': position.damping: "),
    ("plant.measurement.seed = { integers = [1.5, 2] }", {}, "parameters.plant.measurement.seed"),
])
def test_a_wrong_file_is_refused_before_anything_is_run(parameters, changed, says, tmp_path,
                                                        capsys):
    path = write(tmp_path, parameters, **changed)
    assert run_command(["sweep", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert list(tmp_path.iterdir()) == [path]


def test_unreadable_files_and_unknown_names_are_named(tmp_path):
    (tmp_path / "bad.toml").write_text("name = ")
    with pytest.raises(SweepError, match=r"bad\.toml.*Invalid value"):
        load_sweep(tmp_path / "bad.toml")
    with pytest.raises(SweepError, match=r"no\.toml.*does not exist"):
        load_sweep(tmp_path / "no.toml")
    with pytest.raises(HierarchyError, match="did you mean 'ellipse-starts'"):
        load_sweep("ellipse-start")


def test_every_shipped_sweep_can_be_planned():
    assert "ellipse-starts" in shipped_sweeps()
    for name in shipped_sweeps():
        small = load_sweep(name).model_copy(update={"samples": 2})
        assert len(plan(small).runs) == 2 * len(small.resolvers) * len(small.scenarios)


def test_a_scenario_file_is_found_beside_the_sweep(tmp_path):
    (tmp_path / "mine.toml").write_text('extends = "ellipse"\nname = "mine"\n')
    planned = plan(load_sweep(write(tmp_path, scenarios='["mine.toml", "ellipse"]')))
    assert {one.scenario for one in planned.runs} == {"mine", "ellipse"}


def sampled(asked, index):
    return drawn(load("ellipse"), asked.parameters, asked.seed, index)


def test_samples_stay_as_they_are_when_others_are_added(tmp_path):
    few = load_sweep(write(tmp_path))
    more = load_sweep(write(tmp_path, PARAMETERS + "pointing.damping = { around = 0.5 }",
                            samples="9", resolvers='["hcod", "tpm"]'))
    for index in range(3):
        first, second = sampled(few, index), sampled(more, index)
        assert first.items() <= second.items()
    assert sampled(few, 0) != sampled(few, 1)
    other = few.model_copy(update={"seed": 8})
    assert sampled(few, 0)["start.q"] != sampled(other, 0)["start.q"]


def test_samples_are_drawn_from_what_the_file_says(tmp_path):
    asked, ellipse = load_sweep(write(tmp_path)), load("ellipse")
    found = [sampled(asked, index) for index in range(400)]
    q = np.array([one["start.q"] for one in found]) - ellipse.start.q
    assert np.abs(q).max() <= 0.05
    assert q.std() == pytest.approx(0.05 / np.sqrt(3.0), rel=0.05)
    centre = np.array([one["avoidance.obstacles.0.centre"] for one in found])
    np.testing.assert_allclose(np.ptp(centre, axis=0), [0.02, 0.04, 0.0], rtol=0.05)
    damping = [one["position.damping"] for one in found]
    assert (np.mean(damping), np.std(damping)) == pytest.approx((20.0, 1.0), abs=0.15)
    assert 30.0 <= min(one["position.stiffness"] for one in found) < 32.0
    assert {one["pointing.alpha_d"] for one in found} == {5.0, 15.0}
    assert {one["plant.measurement.seed"] for one in found} == {3, 4, 5}


def test_all_resolvers_see_the_same_samples_and_no_run_is_planned_twice(tmp_path):
    planned = plan(load_sweep(write(tmp_path, resolvers='["tpm", "recursive", "tpm"]')))
    texts = {}
    for one in planned.runs:
        texts.setdefault(one.sample, set()).add(one.job.text)
    assert [len(seen) for seen in texts.values()] == [1, 1, 1]
    assert len({one.job.key for one in planned.runs}) == len(planned.runs) == 6
    assert len(plan(load_sweep(write(tmp_path, ""))).runs) == 2  # all samples are the same


def test_a_resolver_that_cannot_resolve_a_scenario_is_not_run_on_it(tmp_path):
    planned = plan(load_sweep(write(tmp_path, "", scenarios='["ellipse-hqp", "ellipse"]')))
    assert {one.scenario for one in planned.runs} == {"ellipse"}
    assert len(planned.refused) == 2


# One run

def test_a_run_has_every_metric_of_its_scenario_as_sampled(tmp_path):
    one = plan(load_sweep(write(tmp_path))).runs[1]
    found = run(one.job.text, one.job.resolver, one.job.key)
    changes = dict(one.values)
    obstacles = [list(o.centre) for o in load("ellipse").avoidance.obstacles]
    obstacles[0] = changes.pop("avoidance.obstacles.0.centre")
    scenario = load("ellipse", {**changes, "avoidance.obstacles": obstacles,
                                "control.duration": 0.02}).with_resolver("recursive")
    expected = metrics.measure(simulate(scenario))
    assert (found.ticks, found.fault, found.error, found.versions) == (20, None, None, digest())
    assert {m.name: m.value for m in found.metrics if m.group != "Computing"} == {
        m.name: m.value for m in expected.values() if m.group != "Computing"}


def test_a_run_that_breaks_is_a_row_with_its_reason(tmp_path, cluster):
    path = write(tmp_path, "start.q = { choice = [[0.1], [0.1, 0.2]] }", samples="8")
    done = sweep(path, tmp_path / "out", scheduler=cluster)
    found = rows(tmp_path / "out")
    assert len(found) == done.failed == 4  # 2 values, 2 resolvers
    assert all("for 7 joint positions" in row["error"] and row["ticks"] == 0 for row in found)
    page = (tmp_path / "out" / "index.html").read_text()
    assert "did not finish" in page
    assert found[0]["error"].partition(":")[0] in page


# All runs

def test_the_rows_are_the_same_wherever_they_are_made(tmp_path, cluster):
    path = write(tmp_path)
    assert run_command(["sweep", str(path), "--out", str(tmp_path / "a"), "--workers", "1"]) == 0
    assert run_command(["sweep", str(path), "--out", str(tmp_path / "b"),
                        "--scheduler", cluster]) == 0
    first, second = rows(tmp_path / "a"), rows(tmp_path / "b")
    assert [timeless(row) for row in first] == [timeless(row) for row in second]
    assert [(row["resolver"], row["sample"]) for row in first] == [
        (resolver, sample) for sample in range(3) for resolver in ("tpm", "recursive")]
    assert all(row["ticks"] == 20 and len(row["start.q"]) == 7 for row in first)


def test_a_sweep_makes_only_the_runs_that_are_not_there(tmp_path, cluster):
    assert sweep(write(tmp_path), tmp_path / "out", scheduler=cluster).made == 6
    assert sweep(write(tmp_path), tmp_path / "out", scheduler="tcp://127.0.0.1:1").made == 0
    more = write(tmp_path, samples="4", resolvers='["hcod", "tpm"]')
    assert sweep(more, tmp_path / "out", scheduler=cluster).made == 5
    assert set(keys_kept(tmp_path / "out").values()) == {1}
    assert len(rows(tmp_path / "out")) == 8


def test_a_worker_that_is_killed_loses_nothing(tmp_path):
    planned = plan(load_sweep(write(tmp_path, samples="8", duration="0.2")))
    store, killed = Store(tmp_path / "out"), []

    def keep(outcomes):
        store.add(outcomes)
        if not killed:
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

    with store.opened(), connected(workers=2) as client:
        carry_out([one.job for one in planned.runs], client, keep, batch=2)
        assert killed[0] not in client.run(os.getpid).values()
    kept = keys_kept(tmp_path / "out")
    assert kept == Counter(one.job.key for one in planned.runs)
    assert store.table()["error"].null_count == len(planned.runs)


def test_a_run_that_kills_its_workers_is_a_row_and_those_beside_it_are_made(tmp_path, monkeypatch):
    """With one death allowed less than usual, for a worker takes seconds to start again."""
    from dataclasses import replace

    monkeypatch.setattr(engine, "_DEATHS", engine._DEATHS - 1)
    jobs = [one.job for one in plan(load_sweep(write(tmp_path))).runs]
    jobs[2] = replace(jobs[2], resolver="deadly")
    found = []
    with connected(workers=1) as client:
        carry_out(jobs, client, found.extend, batch=3, work=dies_of_one)
    assert Counter(one.key for one in found) == Counter(job.key for job in jobs)
    broken = [one for one in found if one.error]
    assert [one.key for one in broken] == [jobs[2].key]
    assert "every worker that started this run died" in broken[0].error


def test_a_connection_that_breaks_is_made_anew_and_loses_nothing(tmp_path, cluster):
    jobs, found = [one.job for one in plan(load_sweep(write(tmp_path))).runs], []

    def keep(outcomes):
        if not found:
            client.loop.add_callback(client.scheduler_comm.comm.abort)
        found.extend(outcomes)

    with connected(scheduler=cluster) as client:
        carry_out(jobs, client, keep, batch=1)
    assert sorted(one.key for one in found) == sorted(job.key for job in jobs)
    assert not any(one.error for one in found)


KILLED_AFTER_THE_FIRST_PART = """
import os, pathlib, signal
import psutil
from scenarios.sweep.store import Store

add = Store.add

def add_and_die(store, outcomes):
    add(store, outcomes)
    workers = psutil.Process().children(recursive=True)
    pathlib.Path("workers").write_text(" ".join(str(one.pid) for one in workers))
    os.kill(os.getpid(), signal.SIGKILL)

Store.add = add_and_die
from scenarios.cli.main import main
main()
"""


def alive(pids):
    """The processes of these numbers that have not ended."""
    for pid in pids:
        with suppress(psutil.NoSuchProcess):
            yield psutil.Process(pid)


def test_a_sweep_that_is_killed_goes_on_where_it_stopped(tmp_path, cluster):
    path, out = write(tmp_path, samples="8"), tmp_path / "out"
    died = subprocess.run([sys.executable, "-c", KILLED_AFTER_THE_FIRST_PART, "sweep", str(path),
                           "--out", str(out), "--workers", "2"], cwd=tmp_path, check=False)
    assert died.returncode == -signal.SIGKILL
    workers = (tmp_path / "workers").read_text().split()
    assert len(workers) >= 2
    assert psutil.wait_procs(alive(map(int, workers)), timeout=300.0)[1] == []
    before = keys_kept(out)
    assert 0 < len(before) < 16
    assert not (out / "index.html").exists()
    assert sweep(path, out, scheduler=cluster).made == 16 - len(before)
    assert keys_kept(out) == Counter(row["key"] for row in rows(out))
    assert len(rows(out)) == 16


# What is kept

def outcomes(*keys):
    found = (metrics.Metric("speed_max", "Joint speed, max", 1.5, "rad/s"),)
    return [Outcome(key, 20, None, None, 0.1, "now", found) for key in keys]


def full(*arguments, **settings):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_is_said_and_what_was_written_before_can_be_read(tmp_path, monkeypatch):
    store = Store(tmp_path / "out")
    with store.opened():
        store.add(outcomes("a", "b"))
        monkeypatch.setattr(parquet, "write_table", full)
        with pytest.raises(FullError, match=r"out/parts/\w+\.parquet cannot be written: No space"):
            store.add(outcomes("c"))
    assert store.keys() == {"a", "b"}
    assert len(list((tmp_path / "out" / "parts").iterdir())) == 1


def test_a_full_disk_ends_the_command_with_1(tmp_path, cluster, monkeypatch, capsys):
    arguments = ["sweep", str(write(tmp_path)), "--out", str(tmp_path / "out"), "--scheduler",
                 cluster]
    with monkeypatch.context() as patched:
        patched.setattr(parquet, "write_table", full)
        assert run_command(arguments) == 1
    said = capsys.readouterr().err
    assert "No space left on device" in said
    assert "out/parts/" in said
    assert run_command(arguments) == 0


def test_a_damaged_part_is_named(tmp_path):
    store = Store(tmp_path / "out")
    with store.opened():
        store.add(outcomes("a")).write_bytes(b"PAR1")
        with pytest.raises(StoreError, match=r"parts/\w+\.parquet cannot be read .* remove it"):
            store.keys()


def test_a_folder_that_is_in_use_or_no_sweep_is_left_alone(tmp_path):
    with Store(tmp_path / "out").opened(), pytest.raises(StoreError, match="another sweep"), Store(
            tmp_path / "out").opened():
        pass
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(StoreError, match="not a sweep"), Store(tmp_path).opened():
        pass


def test_an_address_without_a_scheduler_is_named(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("scenarios.sweep.engine._PATIENCE", 0.5)
    arguments = ["sweep", str(write(tmp_path)), "--out", str(tmp_path / "out")]
    assert run_command([*arguments, "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in capsys.readouterr().err


def test_a_worker_with_other_code_is_refused(tmp_path, cluster, monkeypatch, capsys):
    monkeypatch.setattr("scenarios.sweep.engine.digest", lambda: "another")
    arguments = ["sweep", str(write(tmp_path)), "--out", str(tmp_path / "out")]
    assert run_command([*arguments, "--scheduler", cluster]) == 1
    assert "other versions" in capsys.readouterr().err
    assert keys_kept(tmp_path / "out") == Counter()


# What it comes to

def test_the_page_links_worst_runs_to_files_that_give_the_same_numbers(tmp_path, cluster):
    done = sweep(write(tmp_path), tmp_path / "out", scheduler=cluster)
    page = (tmp_path / "out" / "index.html").read_text()
    assert "All 6 runs reached the end" in page
    for worst in done.found["ellipse"].worst():
        name = next(file for file in (tmp_path / "out" / "worst").iterdir()
                    if worst.run.job.key[:6] in file.name)
        assert f"hierarchy run {tmp_path / 'out' / 'worst' / name.name}" in page
        again = metrics.measure(simulate(load(name)))
        assert again[worst.metric.name].value == worst.metric.value


def test_the_table_of_a_sweep_fits_80_columns(tmp_path, cluster, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.chdir(tmp_path)
    path = write(tmp_path, resolvers='["tpm", "recursive", "augmented", "hqp:backend=osqp"]')
    assert run_command(["sweep", path.name, "--scheduler", cluster]) == 0
    assert (tmp_path / "runs" / "sweep-small" / "index.html").exists()
    table = capsys.readouterr().out.partition("\nReport")[0]
    assert max(map(len, table.splitlines())) <= 80
    assert "…" not in table


@pytest.mark.parametrize(("met", "of", "low", "high"), [
    (0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (10, 10, 0.7225, 1.0), (81, 263, 0.2553, 0.3662),
    (0, 0, 0.0, 1.0)])
def test_the_interval_of_a_share_is_wilsons(met, of, low, high):
    assert wilson(met, of) == pytest.approx((low, high), abs=1e-4)


def test_help_names_the_sweep_and_needs_nothing_of_it():
    code = ("import sys; from scenarios.cli.main import run_command; run_command(['--help']); "
            "print({'distributed', 'dask', 'pyarrow', 'pydantic'} & set(sys.modules))")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "sweep" in done.stdout
    assert done.stdout.endswith("set()\n")


@pytest.mark.slow
def test_the_processes_of_a_sweep_speak_tls():
    pytest.importorskip("cryptography", reason="needs the extra sweep")
    with connected(workers=1) as client:
        assert client.scheduler.address.startswith("tls://127.0.0.1:")
        assert client.submit(abs, -1).result() == 1
