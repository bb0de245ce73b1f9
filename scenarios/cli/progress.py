"""A progress bar on standard error if that is a terminal, otherwise nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def bar(what: str = "ticks") -> Iterator[Callable[[str, int, int], None] | None]:
    """Yield a function to call as told(label, done, total), or None if there is no terminal.

    `what` is the unit of the count.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(),
               TextColumn(f"{{task.completed:.0f}}/{{task.total:.0f}} {what}"),
               TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        lines: dict[str, int] = {}

        def told(label: str, done: int, total: int) -> None:
            if label not in lines:
                lines[label] = int(progress.add_task(escape(label), total=total))
            progress.update(lines[label], completed=done)  # type: ignore[arg-type]

        yield told
