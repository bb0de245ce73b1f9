"""A recording as an MCAP file with every tick and a 3D scene, and a layout of panels for it."""

import json
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import file_path, refuse
from scenarios.export import foxglove
from scenarios.files import OutputError, named, write_text, written
from scenarios.recording.recording import Recording
from scenarios.recording.signals import OTHER, known
from scenarios.scene.drawn import scene
from scenarios.templates import resource

__all__ = ["export"]

FRAMES_A_SECOND = 30.0  # of the 3D scene; signals have every tick

Panel = dict[str, Any]
Entry = tuple[int, str, dict[str, Any]]  # [ns], topic, message


def export(recording: Recording, path: str | Path) -> list[Path]:
    """Write a recording to an MCAP file, and a layout for Foxglove to `path`.layout.json.

    Every signal of every tick has the name and the topic of `scenarios.recording.signals`, times
    are counted from zero, numbers that are not finite are null, and an array with several indices
    is one flat list. `/stack` also has the names of the tasks, `/events` the trouble, `/tf` and
    `/scene` the 3D scene. The same recording gives the same bytes. Returns the files written. For
    tables there is `Recording.to_dataframe`.

    Raises
    ------
    OutputError : a file exists or cannot be written.
    HierarchyError : the suffix is another one, or the package mcap is not installed.
    """
    path = file_path("export", path)
    refuse(path.suffix != ".mcap", f"{path} is no .mcap file; for CSV, Parquet and other tables: "
           "scenarios.load_run(folder).to_dataframe()")
    refuse(find_spec("mcap") is None, "mcap is not installed; pip install 'task-hierarchy[export]'")
    from mcap.writer import Writer

    files = [path, path.with_name(f"{path.name}.layout.json")]
    for file in files:
        with named(file):
            if file.exists():
                raise OutputError(f"{file} exists; choose another name, or remove it first")
            file.parent.mkdir(parents=True, exist_ok=True)
    with named(path), written(path) as partial, partial.open("wb") as stream:
        _write(Writer(stream), recording, grouped(recording))
    with named(files[1]):
        write_text(files[1], json.dumps(layout(recording), indent=1) + "\n")
    return files


def grouped(recording: Recording) -> dict[str, dict[str, NDArray[Any]]]:
    """Return the per-tick signals by channel and name, without time."""
    signals = {name: signal for name, signal in recording.of_ticks().items() if name != "t"}
    groups: dict[str, dict[str, NDArray[Any]]] = {}
    for name, signal in signals.items():
        flat = signal if signal.ndim < 3 else signal.reshape(
            len(signal), int(np.prod(signal.shape[1:])))
        of = known(name)
        groups.setdefault(of.topic if of else OTHER, {})[name] = flat
    groups["/stack"]["tasks"] = recording.stacks()
    return groups


def _write(writer: Any, recording: Recording, groups: dict[str, dict[str, NDArray[Any]]]) -> None:
    writer.start(library="task-hierarchy")
    units = recording.units()
    schemas = {}
    for topic, group in groups.items():
        schema = foxglove.schema({name: np.zeros((1,) * (signal.ndim - 1), signal.dtype).tolist()
                                  for name, signal in group.items()})
        for name, of in schema["properties"].items():
            of["description"] = " ".join(units.get(name, ()))
        schemas[topic] = f"hierarchy.{topic[1:]}", schema
    schemas |= dict(zip(("/tf", "/scene", "/events"), foxglove.FOXGLOVE.items(), strict=True))
    channels = {topic: writer.register_channel(topic, "json", writer.register_schema(
        name, "jsonschema", _bytes(schema))) for topic, (name, schema) in schemas.items()}
    for at, topic, message in sorted(_entries(recording, groups), key=lambda entry: entry[0]):
        writer.add_message(channels[topic], at, _bytes(message), at)
    writer.add_metadata("scenario", {"toml": recording.scenario.to_toml(),
                                     "fault": recording.fault or ""})
    writer.finish()


def _entries(recording: Recording, groups: dict[str, dict[str, NDArray[Any]]]) -> Iterator[Entry]:
    times = [foxglove.nanoseconds(t) for t in recording["t"]]
    drawn = scene(recording, FRAMES_A_SECOND)
    for frame, t in enumerate(drawn.t):
        yield foxglove.nanoseconds(t), "/tf", foxglove.transforms(drawn, frame)
    for frame, update in foxglove.scene_updates(drawn, round(FRAMES_A_SECOND)):
        yield foxglove.nanoseconds(drawn.t[frame]), "/scene", update
    for topic, group in groups.items():
        names, rows = list(group), zip(*(_plain(signal) for signal in group.values()), strict=True)
        for at, row in zip(times, rows, strict=True):
            yield at, topic, dict(zip(names, row, strict=True))
    for tick, kind, action in recording.events:
        yield times[tick], "/events", foxglove.log(recording["t"][tick], f"{kind}: {action}", tick)


def _plain(values: NDArray[Any]) -> Any:
    """Return numbers as nested lists, with None for those that are not finite."""
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        return np.where(np.isfinite(values), values.astype(object), np.array(None)).tolist()
    return values.tolist()


def _bytes(message: dict[str, Any]) -> bytes:
    return json.dumps(message, separators=(",", ":"), allow_nan=False).encode()


def layout(recording: Recording) -> Panel:
    """Return the layout: the 3D view on the left; curves, stack and events on the right.

    That is `layout.json` with the robot's joints and floor, and without panels of absent signals.
    """
    found: Panel = json.loads(resource("export/layout.json"))
    panels, robot = found["configById"], recording.facts.robot
    space, speeds = panels["3D!arm"], panels["Plot!speeds"]
    space["cameraState"]["targetOffset"][2] += robot.floor
    space["layers"]["grid"]["position"][2] = robot.floor
    speeds["paths"] = [speeds["paths"][0] | {"value": f"/joints.v[{j}]", "label": name}
                       for j, name in enumerate(robot.velocity_names)]
    for signal, panel in (("position_error", "error"), ("minimal_distance", "distance")):
        if signal not in recording:
            del panels[f"Plot!{panel}"]
    column: Any
    *above, column = (name for name in panels if name != "3D!arm")
    for count, name in enumerate(reversed(above), 2):  # one below the other, of equal height
        column = {"direction": "column", "first": name, "second": column,
                  "splitPercentage": round(100 / count, 2)}
    found["layout"]["second"] = column
    return found
