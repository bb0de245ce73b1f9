"""`hierarchy run`: simulate a scenario, save the run, print its metrics."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path

from scenarios.cli.figures import redraw
from scenarios.cli.progress import bar
from scenarios.cli.terminal import (
    certified,
    exit_code,
    levels_given_up,
    print_json,
    print_table,
    shown,
    troubles,
)
from scenarios.config import Scenario
from scenarios.config.validation import doubtful_units
from scenarios.loop.first_tick import contact_warnings
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import as_plain_data
from scenarios.measure.run_folder import kept
from scenarios.measure.runs import Run
from scenarios.measure.verdict import verdict
from scenarios.recording.recording import Recording


def run_scenario(scenario: Scenario, folder: Path, certify: bool, figures: bool,
                 as_json: bool) -> int:
    """Run a scenario, save and print the run, and return the exit code."""
    for text in (*doubtful_units(scenario), *contact_warnings(scenario)):
        print(f"hierarchy: warning: {text}", file=sys.stderr)
    with bar() as told:
        told_of_it = partial(told, str(scenario.make_resolver().label))
        recording = simulate(scenario, progress=told_of_it, certified=certify)
    if lost := kept(recording, folder):
        return exit_code(lost)
    if figures:
        redraw([folder])
    if as_json:
        print_json({"scenario": scenario.name, "resolver": scenario.control.resolver,
                    "folder": shown(folder), **as_plain_data(recording),
                    **verdict(recording).as_plain_data()})
    else:
        _print(scenario, recording, certify)
        print(f"\n{recording.ticks} ticks in {shown(folder)}")
    return exit_code(recording.fault)


def _print(scenario: Scenario, recording: Recording, certify: bool) -> None:
    """Print the metrics of a run, its certificate, its troubles and the levels that it missed."""
    resolver = scenario.make_resolver()
    print_table([Run(scenario, scenario.control.resolver, str(resolver.label), recording)])
    if certify:
        print(f"\n{certified(recording, resolver.damping)}")
    for line in (*troubles(recording), *levels_given_up(recording)):
        print(line)
