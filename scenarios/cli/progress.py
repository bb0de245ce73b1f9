"""Progress on standard error: a bar if that is a terminal, otherwise a line now and then."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

_EVERY = 10.0  # [s] between two lines


@contextmanager
def bar(what: str = "ticks") -> Iterator[Callable[[str, int, int], None]]:
    """Yield a function to call with (label, done, total); `what` is the unit of the count."""
    if not sys.stderr.isatty():
        yield lines(what)
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(),
               TextColumn(f"{{task.completed:.0f}}/{{task.total:.0f}} {what}"),
               TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        tasks: dict[str, int] = {}

        def told(label: str, done: int, total: int) -> None:
            if label not in tasks:
                tasks[label] = int(progress.add_task(escape(label), total=total))
            progress.update(tasks[label], completed=done)  # type: ignore[arg-type]

        yield told


def lines(what: str, clock: Callable[[], float] = monotonic) -> Callable[[str, int, int], None]:
    """Return a function like that of `bar` that prints a line every 10 s, with what is left.

    clock : returns the present time [s].
    """
    begun: dict[str, tuple[float, int]] = {}
    said = clock()

    def told(label: str, done: int, total: int) -> None:
        nonlocal said
        now = clock()
        start, first = begun.setdefault(label, (now, done))
        if now - said < _EVERY or done >= total:
            return
        said = now
        pace = (now - start) / (done - first) if done > first else None
        left = "" if pace is None else f", about {(total - done) * pace:.0f} s left"
        print(f"{label}: {done} of {total} {what}{left}", file=sys.stderr, flush=True)

    return told
