"""A layout of Foxglove's panels for the MCAP file of a run."""

from __future__ import annotations

from typing import Any

from scenarios.recording.recording import Recording

Panel = dict[str, Any]


def layout(recording: Recording) -> Panel:
    """Return the layout: the 3D view on the left; curves, stack and events on the right."""
    robot = recording.facts.robot
    panels: dict[str, Panel] = {
        "3D!arm": _space(robot.floor),
        "Plot!speeds": _plot("Joint speeds", [
            (f"/joints.v[{j}]", name) for j, name in enumerate(robot.velocity_names)]),
        "StateTransitions!stack": {"paths": [{"value": "/stack.tasks", "label": "stack",
                                              "timestampMethod": "receiveTime"}]},
        "Log!events": {"searchTerms": [], "minLogLevel": 1, "topicToRender": "/events"}}
    curves = []
    if "position_error" in recording:
        curves.append("Plot!error")
        panels["Plot!error"] = _plot("Position error [m]", [
            (f"/end_effector.position_error[{i}]", axis) for i, axis in enumerate("xyz")])
    if "minimal_distance" in recording:
        curves.append("Plot!distance")
        panels["Plot!distance"] = _plot("Distance to the nearest obstacle [m]", [
            ("/distances.minimal_distance", "body"), ("/distances.ee_distance", "end effector")])
    right = [*curves, "Plot!speeds", "StateTransitions!stack", "Log!events"]
    return {"configById": panels, "globalVariables": {}, "userNodes": {},
            "playbackConfig": {"speed": 1},
            "layout": {"direction": "row", "first": "3D!arm", "second": _column(right),
                       "splitPercentage": 55}}


def _column(names: list[str]) -> Any:
    """Return panels one below the other, of equal height."""
    if len(names) == 1:
        return names[0]
    return {"direction": "column", "first": names[0], "second": _column(names[1:]),
            "splitPercentage": round(100 / len(names), 2)}


def _plot(title: str, paths: list[tuple[str, str]]) -> Panel:
    return {"title": title, "showXAxisLabels": True, "showYAxisLabels": True, "showLegend": True,
            "legendDisplay": "top", "isSynced": True, "xAxisVal": "timestamp",
            "paths": [{"value": value, "label": label, "enabled": True, "showLine": True,
                       "timestampMethod": "receiveTime"} for value, label in paths]}


def _space(floor: float) -> Panel:
    return {"followMode": "follow-none", "followTf": "world", "scene": {},
            "cameraState": {"perspective": True, "distance": 2.6, "phi": 65.0, "thetaOffset": 60.0,
                            "targetOffset": [0.0, 0.0, floor + 0.6], "target": [0.0, 0.0, 0.0],
                            "targetOrientation": [0.0, 0.0, 0.0, 1.0], "fovy": 45.0, "near": 0.01,
                            "far": 100.0},
            "transforms": {}, "publish": {}, "imageMode": {},
            "topics": {"/scene": {"visible": True}},
            "layers": {"grid": {"visible": True, "frameLocked": True, "label": "Grid",
                                "instanceId": "grid", "layerId": "foxglove.Grid", "size": 4,
                                "divisions": 20, "lineWidth": 1, "color": "#8884",
                                "position": [0, 0, floor], "rotation": [0, 0, 0],
                                "frameId": "world"}}}
