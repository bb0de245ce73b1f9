"""What goes with the kinds of `control.stack` that are defined at velocity level."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from scenarios.config.avoidance import AvoidanceSection, SeparationSection
from scenarios.config.control import ControlSection
from scenarios.config.tasks import LimitsSection, PointingTask

RIVALS = ("set-based", "smooth")
_PUSHES = ("rate", "influence", "recovery", "limit")  # keys that say how fast a row is left


def unfit(control: ControlSection, limits: LimitsSection | None,
          avoidance: AvoidanceSection | SeparationSection | None,
          pointing: Mapping[str, PointingTask]) -> Iterator[str]:
    """Yield what a scenario asks for that its kind of stack does not have.

    `pointing` has the pointing tasks by their dotted keys.
    """
    section = avoidance if isinstance(avoidance, SeparationSection) else None
    if control.stack in RIVALS:
        yield from _unfit_control(control, limits)
    if control.stack == "smooth":
        yield from _unfit_buffers(section, pointing)
        return
    if control.stack == "set-based":
        yield from _unused(section, pointing)
    buffered: dict[str, PointingTask | SeparationSection] = {**pointing}
    if section:
        buffered["avoidance"] = section
    for key, one in buffered.items():
        if one.buffer is not None:
            yield (f'{key}.buffer = {one.buffer:g} goes with control.stack = "smooth", got '
                   f'"{control.stack}"')


def _unfit_control(control: ControlSection, limits: LimitsSection | None) -> Iterator[str]:
    kind = f'control.stack = "{control.stack}"'
    if control.level != "velocity":
        yield (f'{kind} needs control.level = "velocity", got "{control.level}": the method '
               "commands rates that may change at once, which accelerations cannot")
    if limits and limits.place in ("stack", "bounds"):
        yield f'{kind} needs limits.place = "guard", got "{limits.place}"'
    if control.transition != "none":
        yield f'control.transition = "{control.transition}" does not go with {kind}'
    if control.strictness:
        yield f"control.strictness = true does not go with {kind}"


def _unused(section: SeparationSection | None,
            pointing: Mapping[str, PointingTask]) -> Iterator[str]:
    """Yield the keys of pushing back that are set: a set-based task is frozen."""
    why = 'does not go with control.stack = "set-based": a task is frozen, not pushed'
    for key in _PUSHES if section else ():
        if (value := getattr(section, key)) != SeparationSection.model_fields[key].default:
            yield f"avoidance.{key} = {value:g} {why}"
    for where, task in pointing.items():
        if task.rows == "inequality" and task.gain != PointingTask.model_fields["gain"].default:
            yield f"{where}.gain = {task.gain:g} {why}"


def _unfit_buffers(section: SeparationSection | None,
                   pointing: Mapping[str, PointingTask]) -> Iterator[str]:
    """Yield the buffers that are missing, not used, or too wide."""
    lacks = 'control.stack = "smooth" needs {}.buffer, in which an inequality comes into effect'
    for where, task in pointing.items():
        if task.rows == "equality" and task.buffer is not None:
            yield f'{where}.buffer = {task.buffer:g} does not go with {where}.kind = "equality"'
        if task.rows == "inequality" and task.buffer is None:
            yield lacks.format(where)
        if task.rows == "inequality" and (task.buffer or 0.0) > task.alpha_d:
            yield (f"{where}.buffer = {task.buffer:g} deg is wider than {where}.alpha_d = "
                   f"{task.alpha_d:g} deg")
    if section and section.buffer is None:
        yield lacks.format("avoidance")
    elif section and section.buffer is not None:
        widest = max(section.distance, section.self_collision or 0.0)
        if widest + section.buffer >= section.influence:
            yield (f"avoidance.buffer = {section.buffer:g} m reaches from {widest:g} m beyond "
                   f"avoidance.influence = {section.influence:g} m")
