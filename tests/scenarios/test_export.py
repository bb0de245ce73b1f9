"""Exports: read back by the packages that others read them with, they are the recording."""

import json
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from scenarios import load, simulate
from scenarios.export import _bytes, export
from scenarios.recording.recording import Event


@pytest.fixture(scope="module")
def run():
    recording = simulate(load("ellipse", ["control.duration=0.15"]))
    recording.signals["ee_distance"][3] = np.nan
    recording.signals["minimal_distance"][4] = np.inf
    return replace(recording, events=(Event(5, "overrun", "hold"), Event(5, "inside", "brake")))


@pytest.fixture(scope="module")
def messages(run, tmp_path_factory):
    """Messages by topic: (time [ns], content), and the layout."""
    reader = pytest.importorskip("mcap.reader")
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    written = export(run, path)
    assert [one.name for one in written] == ["run.mcap", "run.mcap.layout.json"]
    found, schemas = {}, {}
    with path.open("rb") as stream:
        for schema, channel, message in reader.make_reader(stream).iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            schemas[channel.topic] = (schema.name, json.loads(schema.data))
            found.setdefault(channel.topic, []).append((message.log_time, json.loads(message.data)))
    return found, schemas, json.loads(written[1].read_text())


def test_an_mcap_file_has_every_signal_of_every_tick(run, messages):
    found, _, _ = messages
    read = {}
    for topic in ("/joints", "/end_effector", "/distances", "/stack", "/times", "/other"):
        assert [at for at, _ in found[topic]] == [round(t * 1e9) for t in run["t"]]
        for name in found[topic][0][1]:
            read[name] = [message[name] for _, message in found[topic]]
    assert read.pop("tasks") == [run.orders[i] for i in run["order"]]
    assert set(read) | {"t"} == set(run.signals) - {"joint_lower", "joint_upper", "velocity_limit"}
    for name, values in read.items():
        signal = run[name].astype(float)
        np.testing.assert_array_equal(np.array(values, dtype=float),
                                      np.where(np.isfinite(signal), signal, np.nan))


def test_every_message_is_as_its_schema_says_which_tells_units_and_what_foxglove_draws(messages):
    found, schemas, _ = messages
    for topic, entries in found.items():
        for _, message in entries:
            assert_fits(message, schemas[topic][1], topic)
    assert schemas["/joints"][1]["properties"]["v"]["description"].split() == ["rad/s"] * 7
    assert {topic: schemas[topic][0] for topic in ("/tf", "/scene", "/events")} == {
        "/tf": "foxglove.FrameTransforms", "/scene": "foxglove.SceneUpdate",
        "/events": "foxglove.Log"}


def assert_fits(value, schema, where):
    kinds = {"object": dict, "array": list, "string": str, "integer": int, "boolean": bool,
             "number": (float, int, type(None))}
    assert isinstance(value, kinds[schema["type"]]), where
    if isinstance(value, dict):
        assert set(value) == set(schema["properties"]) or not schema["properties"], where
        for name, part in value.items():
            assert_fits(part, schema["properties"][name], f"{where}.{name}")
    if isinstance(value, list):
        for part in value:
            assert_fits(part, schema["items"], f"{where}[]")


def test_what_is_no_number_in_json_is_not_written():
    with pytest.raises(ValueError, match="JSON"):
        _bytes({"x": [1.0, np.inf]})


def test_without_its_package_nothing_is_exported(run, tmp_path, monkeypatch):
    refused("to_dataframe", export, run, tmp_path / "run.parquet")
    monkeypatch.setattr("scenarios.export.find_spec", lambda name: None)
    refused("pip install 'task-hierarchy[export]'", export, run, tmp_path / "run.mcap")
