"""`hierarchy view`, `export`, `replay`, `why` and `figures`: show finished runs, or a live one."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli.options import PORT, AsJson, Browser, Plugins, Port, Run, Runs, app, output
from scenarios.cli.terminal import exit_code, kept_in, print_files, print_json

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.draw.viewer.live import Live

_POLL = 0.5  # [s] between two looks for an interruption


@app.command()
def view(folders: Runs,
         side_by_side: Annotated[bool, typer.Option(
             "--side-by-side/--overlay", help="Placement of several runs.")] = True,
         plugin: Plugins = None,
         port: Port = PORT, browser: Browser = True) -> int:
    """Show finished runs in the browser.

    In 3D and as curves, as `hierarchy replay` writes them.
    """
    from scenarios.draw.viewer.server import announce, served

    page = _replay(_each(folders), beside=side_by_side)
    with served(port, lambda: page) as address, suppress(KeyboardInterrupt):
        announce(address, browser)
        while True:
            time.sleep(3600.0)
    print()
    return 0


def _each(folders: list[Path]) -> list[Path]:
    """Return the folders of runs, of a comparison those of its own."""
    return [run for folder in folders for run in (
        sorted(file.parent for file in folder.glob("*/*/run.npz"))
        if (folder / "comparison.json").is_file() else ()) or [folder]]


def _replay(folders: list[Path], rate: float = 30.0, beside: bool = False) -> str:
    """Return the page that plays the runs of some folders, by the labels of their resolvers.

    Labels get the scenarios where those differ, and equal labels the folder.
    """
    from scenarios.draw.replay import html
    from scenarios.measure.run_folder import load_run

    recordings = [load_run(folder) for folder in folders]
    several = len({one.scenario.name for one in recordings}) > 1
    labels = [one.facts.resolver.label + f" {one.scenario.name}" * several for one in recordings]
    runs = {label if labels.count(label) == 1 else f"{label} in {folder}": one
            for label, folder, one in zip(labels, folders, recordings, strict=True)}
    titles = dict.fromkeys(one.scenario.title or one.scenario.name for one in recordings)
    return html(runs, " · ".join(titles), rate=rate, beside=beside)


def show_live(scenario: Scenario, folder: Path, port: int, speed: float, browser: bool,
              wait: bool = True) -> int:
    """Run a scenario live in the browser, save the run, and return 1 if it stopped with a fault.

    With `wait` the run starts when the first browser has opened the page.

    The run is saved when it ends or at Ctrl-C, in `folder` or, after a restart, beside it. A run
    that is restarted before its end is not saved.
    """
    from scenarios.draw.viewer.live import Live
    from scenarios.draw.viewer.live_page import FRAMES, LivePage
    from scenarios.draw.viewer.server import announce, served

    live = Live(scenario)
    page, kept, lost = LivePage(live, speed), None, False
    with served(port, page.html, page.answer) as address:
        try:
            announce(address, browser)
            while wait and not page.opened.wait(_POLL):
                pass
            last = time.monotonic()
            while True:
                time.sleep(1.0 / FRAMES)
                now = time.monotonic()
                page.step(now - last)
                last = now
                if live.over and kept is not live.recorder:
                    kept = live.recorder
                    lost |= _keep(live, folder)
        except KeyboardInterrupt:
            print()
            if not live.over:
                lost |= _keep(live, folder)
    return int(lost or live.ending is not None)


def _keep(live: Live, folder: Path) -> bool:
    """Save the run in its folder, or in the next free one beside it; return whether that fails."""
    from scenarios.files import next_free
    from scenarios.measure.run_folder import kept

    used = folder.exists() and any(folder.iterdir())
    free = next_free(folder) if used else folder
    recording = live.recording()
    lost = kept(recording, free, live.changes)
    if lost is None:
        print(kept_in(free, recording), flush=True)
    for fault in (recording.fault, lost):
        exit_code(fault)
    return lost is not None


@app.command()
def export(folder: Run,
           out: Annotated[Path | None, output(
               "A new file. Default: run.mcap in RUN.", "FILE")] = None,
           plugin: Plugins = None, as_json: AsJson = False) -> None:
    """Export a run as MCAP, with a layout for Foxglove.

    Needs the extra `export`. Tables: load_run(RUN).to_dataframe() in Python.
    """
    from scenarios import load_run
    from scenarios.export import export as write

    print_files(write(load_run(folder), out or folder / "run.mcap"), as_json)


@app.command()
def replay(folders: Runs,
           out: Annotated[Path | None, output(
               "HTML file to write. Default: RUN/replay.html.", "FILE")] = None,
           rate: Annotated[float, typer.Option(
               "--rate", metavar="HZ", help="Frames per second.")] = 30.0,
           plugin: Plugins = None) -> None:
    """Write runs as one HTML file that plays without a server."""
    from hierarchy.errors import refuse
    from scenarios.files import named, write_text

    target = out if out is not None else folders[0] / "replay.html"
    refuse(target.suffix != ".html", f"{target} is no .html file")  # which another may be
    text = _replay(_each(folders), rate)
    with named(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        write_text(target, text)
    print(f"{target}, {target.stat().st_size / 1e3:.0f} kB")


@app.command()
def why(folder: Run,
        tick: Annotated[int | None, typer.Option(
            "--tick", metavar="N", help="The jump into this tick. Default: the three largest.")
            ] = None,
        plugin: Plugins = None, as_json: AsJson = False) -> None:
    """Say why the command of a run jumped.

    The largest steps of torque, acceleration or speed: bisects between the rows of two ticks.
    """
    from scenarios.measure.happenings import jumps
    from scenarios.measure.run_folder import load_run

    found = jumps(load_run(folder), tick=tick)
    if as_json:
        return print_json({"jumps": [{**vars(one), "causes": [cause._asdict() for cause in
                                                              one.causes]} for one in found]})
    if not found:
        print("The command did not change from any tick to the next.")
    for one in found:
        print(f"tick {one.tick} (t = {one.t:.3f} s): {one}")
        for kind, text in one.causes or (("other", "no single cause"),):
            print(fill(f"{kind}: {text}", 80, initial_indent="  ", subsequent_indent="    "))


@app.command()
def figures(folders: Runs,
            style: Annotated[str, typer.Option(
                "--style", metavar="STYLE",
                help="screen: SVG and PNG. paper: PDF, one column of a journal wide.")] = "screen",
            out: Annotated[Path | None, output(
                "Output folder, new or empty. Default: the run's folder.")] = None,
            plugin: Plugins = None, as_json: AsJson = False) -> None:
    """Draw a run's figures again, for screen or paper.

    Several runs are drawn together, as parts (a), (b), ... of the letter's figures.
    """
    from scenarios.draw.figures.letter import redraw

    print_files(redraw(_each(folders), style, out), as_json)
