"""The tasks of `[[tasks]]` in order of priority, of scenarios.config.kinds or of a plugin."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import scenarios.config.kinds  # noqa: F401, registers them
from hierarchy import plugins
from hierarchy.plugins import Group
from scenarios.config.errors import ScenarioError
from scenarios.config.own import OwnSection
from scenarios.config.sections import any_kind
from scenarios.config.tasks import Listed

if TYPE_CHECKING:
    from hierarchy import Task
    from scenarios.config.references import References


class OwnTask(Listed, OwnSection):
    """A task of a plugin; its keys are those of the plugin."""

    group: ClassVar[Group] = "tasks"
    unit: ClassVar[str] = ""

    @property
    def one_sided(self) -> bool:
        """Whether its rows are inequalities, as the plugin's class says with `kind`."""
        return str(getattr(self.maker, "kind", "equality")) == "inequality"

    def make(self, at: References) -> Task:
        """Return the task; raises ScenarioError for whatever goes wrong in the user's code."""
        from hierarchy import Task
        from hierarchy.errors import brief

        task = self.made(at.robot, state=at.start, name=self.title)
        if not isinstance(task, Task):
            raise ScenarioError(f"the plugin made {brief(task)}, not a Task")
        if task.name != self.title:
            raise ScenarioError(f"its name is {task.name!r}; take the name as the parameter `name`,"
                                " or give the section this name")
        return task


KINDS = tuple(plugins.shipped("tasks"))
if TYPE_CHECKING:
    ListedTask = Listed
else:
    ListedTask = any_kind("tasks", OwnTask)
