"""Jobs handed to Dask: to processes of this machine, or to a cluster; a run does not know which."""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from hierarchy.errors import HierarchyError
from scenarios.sweep.run import Job, Outcome, digest, run_batch

try:
    import dask
    from distributed import (
        Client,
        Future,
        KilledWorker,
        LocalCluster,
        Worker,
        WorkerPlugin,
        as_completed,
    )
except ImportError as error:
    raise HierarchyError("a sweep needs dask.distributed and pyarrow: "
                         "pip install 'task-hierarchy[sweep]'") from error

LARGEST_BATCH = 16     # runs; what is lost when everything is killed, for each worker
_BATCHES_EACH = 4      # at least so many for each worker, so that the last ones end together
_QUEUED_EACH = 3       # batches that the scheduler has at a time, for each worker
_DEATHS = 1            # workers that may die of a batch; at one more it is taken apart
_PATIENCE = 30.0       # [s] for a scheduler to answer and to have a worker

Work = Callable[[Sequence[Job], str], list[Outcome]]


class EngineError(RuntimeError):
    """The runs cannot go on: the scheduler is lost, or a worker has another version."""


class _LeaveInterrupts(WorkerPlugin):  # type: ignore[misc]
    """Ctrl-C, which a terminal sends to all processes, is for the client to act on."""

    def setup(self, worker: Worker) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


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
    settings = {"distributed.scheduler.allowed-failures": _DEATHS,
                "distributed.scheduler.worker-saturation": 1.0,
                "distributed.worker.profile.enabled": False}  # its samples fill the memory
    with dask.config.set(settings), LocalCluster(
            n_workers=workers or processors(), threads_per_worker=1, processes=True,
            host="127.0.0.1", dashboard_address="127.0.0.1:0",  # any free port, and no dashboard:
            scheduler_kwargs={"dashboard": False}, silence_logs=logging.CRITICAL) as cluster, \
            Client(cluster) as client:
        client.register_plugin(_LeaveInterrupts())
        yield client


def carry_out(jobs: Sequence[Job], client: Client, keep: Callable[[list[Outcome]], object],
              told: Callable[[int], object] = lambda count: None, batch: int | None = None,
              work: Work = run_batch) -> None:
    """Have all jobs run, and hand what came of them to `keep`, batch by batch, as it comes.

    A job of which workers die has that as its outcome; those beside it do not.

    Parameters
    ----------
    told : called with the number of jobs done since the last call.
    batch : how many jobs are handed out together; by default up to LARGEST_BATCH.
    work : what runs a batch.

    Raises
    ------
    EngineError : the scheduler is lost, or a worker refuses.
    """
    threads = max(1, _threads(client))
    size = batch or max(1, min(LARGEST_BATCH, len(jobs) // (_BATCHES_EACH * threads)))
    batches = [jobs[first:first + size] for first in range(0, len(jobs), size)]
    suspects: list[Job] = []
    for part, outcomes in _results(client, work, batches, _QUEUED_EACH):
        if outcomes is None:
            suspects += part
        else:
            keep(outcomes)
            told(len(outcomes))
    # One at a time: what else a worker has when it dies is blamed as well.
    for (job,), outcomes in _results(client, work, [[job] for job in suspects], 0):
        keep(outcomes or [_deadly(job)])
        told(1)


def _results(client: Client, work: Work, batches: Sequence[Sequence[Job]], queued: int
             ) -> Iterator[tuple[Sequence[Job], list[Outcome] | None]]:
    """Give each batch with what came of it as it is done, None where workers died of it.

    The scheduler has at most `queued` batches at a time for each worker, and one if that is 0.
    """
    waiting = iter(batches)
    running: dict[str, Sequence[Job]] = {}
    done = as_completed()

    def fill() -> None:
        while len(running) < max(1, queued * _threads(client)) and (part := next(waiting, None)):
            future = client.submit(work, part, digest(), pure=False)
            running[future.key] = part
            done.add(future)

    fill()
    while running:
        future = next(done)
        yield running.pop(future.key), _outcomes(future)
        future.release()
        fill()


def _outcomes(future: Future) -> list[Outcome] | None:
    """Return what came of a batch, or None where workers died of it."""
    if future.status == "finished":
        found: list[Outcome] = future.result()
        return found
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return None
    raise EngineError(f"{error or 'the scheduler is lost'}; what is done is kept")


def _deadly(job: Job) -> Outcome:
    return Outcome(job.key, 0, None, "KilledWorker: every worker that began this run died of it",
                   float("nan"), digest())


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
