"""A validated scenario."""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import tomli_w
from pydantic import Field, field_validator

import scenarios.config.sections.kinds  # noqa: F401, registers them
from hierarchy import plugins
from hierarchy.errors import expect
from scenarios.config.changes import change_all, matching, parse_changes, place, without_none
from scenarios.config.distributions import Distribution, Parameters, Value
from scenarios.config.files import make_absolute
from scenarios.config.sections import Name, Section, naming
from scenarios.config.sections.avoidance import AvoidanceKind
from scenarios.config.sections.control import RIVALS, ControlSection, FaultSection, unfit
from scenarios.config.sections.plant import KinematicSection, PlantKind
from scenarios.config.sections.robot import (
    ContactSection,
    ForcesSection,
    RobotSection,
    StartSection,
)
from scenarios.config.sections.sensor import ExactSection, SensorKind
from scenarios.config.sections.tasks import (
    DampingSection,
    LimitsSection,
    ListedTask,
    PointingSection,
    PositionSection,
    PostureSection,
    alike,
)
from scenarios.config.validation import validated

if TYPE_CHECKING:
    from solvers import Resolver
    from solvers.resolver import Handles


OWN = "own"  # the spec of the resolver that a scenario names itself


class Scenario(Section):
    """A robot, a start, tasks, and how they are resolved.

    Absent sections add no task.
    """

    name: Name  #: Its name, in lists and of run folders.
    title: str = ""  #: One line that says what it shows.
    description: str = ""  #: More about it.
    plugins: tuple[str, ...] | None = None
    """Modules with kinds, resolvers and robots; a command has to allow them."""
    robot: RobotSection  #: Which robot.
    start: StartSection = StartSection()  #: Where a run starts.
    control: ControlSection  #: How the tasks are resolved, and how often.
    plant: PlantKind = KinematicSection()  #: What the commands move.
    sensor: SensorKind = ExactSection()  #: What measures distances to obstacles.
    position: PositionSection | None = None  #: The end effector's position.
    pointing: PointingSection | None = None  #: The end effector's direction.
    avoidance: AvoidanceKind | None = None  #: Obstacles, and how to stay away from them.
    limits: LimitsSection | None = None  #: Joint limits.
    damping: DampingSection | None = None
    """Null-space term that damps joints; not with the null-space [posture]."""
    posture: PostureSection | None = None  #: Null-space term or last task toward a posture.
    tasks: tuple[ListedTask, ...] = ()
    """Tasks in order of priority, below limits, avoidance, position and pointing."""
    contacts: tuple[ContactSection, ...] = ()  #: What touches the surroundings, at level "torque".
    forces: ForcesSection = ForcesSection()  #: Which contact forces the stack allows.
    faults: tuple[FaultSection, ...] = ()  #: What goes wrong during a run.
    variation: Parameters = Field(default_factory=dict)  #: How keys vary from start to start.

    @field_validator("plugins")
    @classmethod
    def _are_allowed(cls, modules: tuple[str, ...] | None) -> tuple[str, ...] | None:
        plugins.require(modules or ())  # before the sections below, which have their kinds
        return modules

    def _wrong(self) -> Iterator[str]:
        yield from self._has_the_level_of_its_forces()
        yield from self._sections_go_together()
        asked = {"pointing": self.pointing} | {f"tasks.{i}": task
                                               for i, task in enumerate(self.tasks)}
        yield from unfit(self.control, self.limits, self.avoidance,
                         {key: task for key, task in asked.items() if task})
        yield from self._lists_tasks_apart()
        yield from self._faults_have_a_sensor()

    def _has_the_level_of_its_forces(self) -> Iterator[str]:
        torque = self.control.level == "torque"
        forces = next((task.title for task in self.tasks if task.of_forces), None)
        for what, given in (("[[contacts]]", self.contacts), (f"task {forces!r}", forces),
                            ("[forces]", self.forces != ForcesSection()),
                            ("start.on_floor", self.start.on_floor)):
            if given and not torque:
                yield f'{what} needs control.level = "torque"'
        if torque and self.control.stack != "hierarchical":
            yield ('control.level = "torque" goes with control.stack = "hierarchical", '
                   f'got "{self.control.stack}"')
        if self.control.level not in self.plant.levels:
            yield ('control.level = "torque" and plant.kind = "torque" go together, got '
                   f'"{self.control.level}" and "{self.plant.kind}"')

    def _sections_go_together(self) -> Iterator[str]:
        if self.damping and self.posture and self.posture.role == "null-space":
            yield "give [damping] or [posture], not both: each is the null-space term"
        if self.posture and self.posture.role == "task" and self.control.stack == "switched":
            yield 'posture.role = "task" goes with control.stack = "hierarchical"'
        if self.control.strictness and not self.position:
            yield "control.strictness needs [position]"
        repels = self.avoidance is not None and self.avoidance.kind == "repulsion"
        if repels and self.control.stack != "switched":
            yield ('avoidance.kind = "repulsion" goes with control.stack = "switched", '
                   f'got "{self.control.stack}"')
        if repels and not self.position:
            yield "[avoidance] needs [position]: Algorithm 1 orders one by the other"
        if self.limits and self.limits.danger_reach and not self.avoidance:
            yield "limits.danger_reach needs the obstacles of [avoidance]"
        clipped = self.control.level == "torque"  # torques that are not limited in the stack
        if self.limits and self.limits.place != "stack" and (
                (self.limits.torque and not clipped) or self.limits.danger_reach):
            yield 'limits.torque and limits.danger_reach need limits.place = "stack"'
        if self.limits and self.limits.place == "guard" and clipped:
            yield ('limits.place = "guard" does not go with control.level = "torque": torques are '
                   "clipped, and joints are not")
        if self.limits and self.limits.torque and self.control.level == "velocity":
            yield 'limits.torque does not go with control.level = "velocity"'
        if self.limits and self.limits.torque_step and not clipped:
            yield "limits.torque_step needs control.level = \"torque\""

    def _lists_tasks_apart(self) -> Iterator[str]:
        if self.tasks and self.control.stack == "switched":
            yield '[[tasks]] goes with control.stack = "hierarchical"'
        names = [task.title for task in self.tasks]
        names += [name for name in ("position", "pointing", "posture") if getattr(self, name)]
        yield from alike(names)
        known = {name.replace(" ", "_") for name in names}
        for task in self.tasks:
            turned = f"{task.title} turned"
            if len(task.shown) > 1 and turned.replace(" ", "_") in known:
                yield f"task {task.title!r}: another one has the name of its rotation, {turned!r}"
        listed = [task for task in self.tasks if task.kind == "collision"]
        if listed and (self.avoidance is None or self.avoidance.kind != "separation"):
            yield ('a task of kind "collision" needs [avoidance] with kind = '
                   '"separation", which says what is kept apart')
        if len(listed) > 1:
            yield f'{len(listed)} tasks are of kind "collision"'

    def _faults_have_a_sensor(self) -> Iterator[str]:
        blind = next((fault.kind for fault in self.faults
                      if fault.kind in ("nan_distance", "obstacle")), None)
        if blind and not self.avoidance:
            yield f"a fault of kind {blind!r} needs [avoidance]"
        kinds, sensor = {fault.kind for fault in self.faults}, self.sensor.kind
        if sensor != "exact" and not self.avoidance:
            yield f"sensor.kind = {sensor!r} needs [avoidance]"
        if not self.sensor.has_frames and kinds & {"no_frames", "dark_frames"}:
            yield "faults of frames need a sensor of kind \"camera\" or \"frames\""
        if self.sensor.is_recorded and "obstacle" in kinds:
            yield "a fault of kind 'obstacle' would not be in the recorded frames"

    @property
    def limits_in_stack(self) -> bool:
        """Whether the joint limits are a level of the stack under its resolver."""
        if self.limits is None or self.limits.place == "guard" or self.control.stack in RIVALS:
            return False
        return self.limits.place in ("stack", "bounds") or self.make_resolver().can_resolve(
            "bounds" if self.control.level != "torque" else "inequalities")

    @property
    def forces_in_stack(self) -> bool:
        """Whether the limits of contact forces and torques are a level of the stack."""
        limits = self.limits
        return self.control.level == "torque" and (
            limits is None or (self.limits_in_stack and limits.place != "bounds"))

    @property
    def asks(self) -> Handles:
        """The kind of rows that its stack has under its resolver.

        In the metric "mass" bounds are rows over several unknowns, see solvers.metric.
        """
        if self.control.stack in RIVALS:
            return "activations" if self.control.stack == "smooth" else "equalities"
        one_sided = self.avoidance is not None and self.avoidance.kind == "separation"
        inequalities = one_sided or (self.control.stack == "hierarchical" and any(
            task.one_sided for task in (self.pointing, *self.tasks) if task))
        if self.forces_in_stack and (self.contacts or self.limits):
            return "inequalities"
        limits = self.limits if self.limits_in_stack else None
        bounds = self.control.metric == "identity" and not (
            limits and limits.torque and limits.place != "bounds")
        if inequalities or (limits and not bounds):
            return "inequalities"
        return "bounds" if limits else "equalities"

    def make_resolver(self) -> Resolver:
        """Make the resolver given by `control.resolver` and `control.options`."""
        from solvers import make

        return make(self.control.resolver, **self.control.settings())

    def with_resolver(self, spec: str) -> Scenario:
        """Return this scenario under another resolver.

        `spec` is `name` or `name:setting=value:setting=value`. The scenario's settings are kept
        if the resolver has them; those of the spec override them. The spec "own" changes nothing.
        """
        from solvers import make

        expect("with_resolver", spec, str, "give name or name:setting=value")
        if spec == OWN:
            return self
        name, *settings = spec.split(":")
        own = {field.name for field in dataclasses.fields(make(name))}
        kept = {key: value for key, value in self.control.options.items()
                if key in own or isinstance(value, dict)}
        options = {**kept, **parse_changes(settings, what=f"resolver {spec!r}")}
        control = {**self.control.model_dump(), "resolver": name, "options": options}
        return validated(Scenario, {**self.model_dump(), "control": control}, f"resolver {spec!r}")

    def with_changes(self, changes: Mapping[str, Any], what: str = "") -> Scenario:
        """Return this scenario with other values at dotted keys.

        Files that they name are relative to the working directory. Raises ScenarioError
        for invalid ones; the message starts with `what`, or the name.
        """
        data = self.model_dump(mode="json")
        change_all(data, changes, Scenario)
        make_absolute(data, Path())
        return validated(Scenario, data, what or f"scenario {self.name!r}")

    def drawn(self, seed: int, index: int, parameters: Mapping[str, Distribution] | None = None,
              what: str = "variation") -> dict[str, Value]:
        """Return the values of sample `index` by dotted key, by default those of its `variation`.

        They depend only on the seed, the index and the key, "around" also on the scenario's value.
        A `*` in a key stands for every entry of a list, each with a draw of its own. Raises
        ScenarioError, which starts with `what` and the key, if there is no suitable value there.
        """
        own, values = self.model_dump(mode="json"), dict[str, Value]()
        parameters = self.variation if parameters is None else parameters
        for pattern, distribution in parameters.items():
            with naming(f"{what}.{pattern}: scenario {self.name!r}", of=ValueError):
                for key in matching(own, pattern):
                    table, last = place(own, key)
                    here = table[last] if isinstance(table, list) else table.get(last)
                    # The same numbers on every machine, for one parameter of one sample.
                    words = np.frombuffer(sha256(key.encode()).digest()[:16], dtype="<u4")
                    chance = np.random.PCG64(np.random.SeedSequence([seed, index, *words.tolist()]))
                    values[key] = distribution.draw(np.random.Generator(chance), here)
        return values

    def with_drawn(self, values: Mapping[str, Value], what: str) -> Scenario:
        """As `with_changes`; the message starts with `what` and has the values."""
        told = ", ".join(f"{key} = {value}" for key, value in values.items())
        return self.with_changes(values, f"{what}, with {told}")

    def __repr__(self) -> str:
        return (f"Scenario({self.name!r}, robot={self.robot.model!r}, "
                f"resolver={self.control.resolver!r})")

    __str__ = __repr__

    @classmethod
    def from_toml(cls, text: str) -> Self:
        """Return the scenario that `to_toml` wrote; raises pydantic's ValidationError."""
        return cls.model_validate(tomllib.loads(text))

    def to_toml(self) -> str:
        """Return the scenario as TOML text that `load` can read."""
        return tomli_w.dumps(without_none(self.model_dump(mode="json")))
