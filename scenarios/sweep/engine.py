"""Jobs handed to Dask: to processes of this machine, or to a cluster; a run does not know which."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from hierarchy.errors import HierarchyError
from scenarios.sweep.run import Job, Outcome, digest, run_batch

try:
    import dask
    from distributed import Client, Future, KilledWorker, LocalCluster, as_completed
except ImportError as error:
    raise HierarchyError("a sweep needs dask.distributed and pyarrow: "
                         "pip install 'task-hierarchy[sweep]'") from error

LARGEST_BATCH = 16     # runs; what is lost when everything is killed, for each worker
_BATCHES_EACH = 4      # at least so many for each worker, so that the last ones end together
_QUEUED_EACH = 3       # batches that the scheduler has at a time, for each worker
_DEATHS = 2            # workers that may die of a batch before it is taken apart
_PATIENCE = 30.0       # [s] for a scheduler to answer and to have a worker

Work = Callable[[Sequence[Job], str], list[Outcome]]


class EngineError(RuntimeError):
    """The runs cannot go on: the scheduler is lost, or a worker has another version."""


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (
        os.cpu_count() or 1)


@contextmanager
def connected(workers: int | None = None, scheduler: str | None = None) -> Iterator[Client]:
    """Give a client of the Dask scheduler at an address, or of processes of this machine.

    There are `workers` of these, by default one for each processor, of one thread each; they listen
    on 127.0.0.1 only and end with this process.

    Raises
    ------
    HierarchyError : no scheduler answers at the address, or it has no workers.
    """
    if scheduler is not None:
        with _client_of(scheduler) as client:
            yield client
        return
    settings = {"distributed.scheduler.allowed-failures": _DEATHS}
    with dask.config.set(settings), LocalCluster(
            n_workers=workers or processors(), threads_per_worker=1, processes=True,
            host="127.0.0.1", dashboard_address=None, silence_logs=logging.CRITICAL
            ) as cluster, Client(cluster) as client:
        yield client


def carry_out(jobs: Sequence[Job], client: Client, keep: Callable[[list[Outcome]], object],
              told: Callable[[int], object] | None = None, batch: int | None = None,
              work: Work = run_batch) -> None:
    """Have all jobs run, and hand what came of them to `keep`, batch by batch, as it comes.

    A job of which workers die has that as its outcome; those beside it in its batch do not.

    Parameters
    ----------
    told : called with the number of jobs done since the last call.
    batch : how many jobs are handed out together; by default up to LARGEST_BATCH.
    work : what runs a batch.

    Raises
    ------
    EngineError : the scheduler is lost, or a worker refuses.
    """
    waiting = iter(_batches(jobs, batch or _size(len(jobs), _threads(client))))
    alone: list[list[Job]] = []
    running: dict[str, tuple[Future, Sequence[Job]]] = {}
    done = as_completed(with_results=False, raise_errors=False)

    def fill() -> None:
        while len(running) < _QUEUED_EACH * max(1, _threads(client)):
            part = alone.pop() if alone else next(waiting, None)
            if part is None:
                return
            future = client.submit(work, part, digest(), pure=False)
            running[future.key] = future, part
            done.add(future)

    fill()
    while running:
        future = next(done)
        _, part = running.pop(future.key)
        outcomes = _outcomes(future, part)
        if outcomes is None:
            alone += [[job] for job in part]
        else:
            keep(outcomes)
            if told is not None:
                told(len(outcomes))
        future.release()
        fill()


def _outcomes(future: Future, part: Sequence[Job]) -> list[Outcome] | None:
    """Return what came of a batch, or None where it killed workers and is to be taken apart."""
    if future.status == "finished":
        found: list[Outcome] = future.result()
        return found
    error = future.exception() if future.status == "error" else None
    if not isinstance(error, KilledWorker):
        raise EngineError(str(error or "the scheduler is lost") + "; what is done is kept")
    if len(part) > 1:
        return None
    said = f"KilledWorker: {_DEATHS + 1} workers died of this run"
    return [Outcome(part[0].key, 0, None, said, float("nan"), digest())]


def _batches(jobs: Sequence[Job], size: int) -> list[Sequence[Job]]:
    return [jobs[first:first + size] for first in range(0, len(jobs), size)]


def _size(jobs: int, threads: int) -> int:
    return max(1, min(LARGEST_BATCH, jobs // (_BATCHES_EACH * max(1, threads))))


def _threads(client: Client) -> int:
    return sum(client.nthreads().values())


def _client_of(address: str) -> Any:
    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError) as error:
        raise HierarchyError(f"no Dask scheduler answers at {address}: {error}") from error
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        client.close()
        raise HierarchyError(f"the Dask scheduler at {address} has no workers") from None
    return client
