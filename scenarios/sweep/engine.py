"""Run jobs with Dask, in processes of this machine or on a cluster."""

from __future__ import annotations

import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.util import find_spec
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
    from distributed.security import Security
except ImportError as error:
    raise HierarchyError("a sweep needs dask.distributed and pyarrow: "
                         "pip install 'task-hierarchy[sweep]'") from error

LARGEST_BATCH = 16     # runs per worker that are lost if everything is killed
_BATCHES_EACH = 16     # per worker at least, so that workers finish at about the same time
_QUEUED_EACH = 3       # batches per worker that are submitted at a time
_DEATHS = 1            # workers a batch may kill; after one more its jobs run one at a time
_LOSSES = 3            # times in a row that a batch is submitted anew to a scheduler that was lost
_PATIENCE = 30.0       # [s] for a scheduler to answer and to have a worker
_RESTART = 600.0       # [s] for a worker that died to be started again, on a machine under load

Work = Callable[[Sequence[Job], str], list[Outcome]]


class EngineError(RuntimeError):
    """The sweep cannot continue: the scheduler is lost, or a worker has another version."""


class _LeaveInterrupts(WorkerPlugin):  # type: ignore[misc]
    """Ignores Ctrl-C in workers: the terminal sends it to all processes, the client handles it."""

    def setup(self, worker: Worker) -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _security() -> Security:
    """Return keys made for one sweep: the scheduler's port runs whatever code it is sent."""
    if find_spec("cryptography") is None:
        print("hierarchy: without the package cryptography, every user of this machine can run "
              "code as you through the sweep's port on 127.0.0.1; in the checkout, "
              "pip install '.[sweep]' installs it", file=sys.stderr)
        return Security()
    return Security.temporary()


def processors() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else (
        os.cpu_count() or 1)


@contextmanager
def connected(workers: int | None = None, scheduler: str | None = None) -> Iterator[Client]:
    """Yield a client of the Dask scheduler at an address, or of local worker processes.

    There are `workers` local processes with one thread each, by default one per processor; they
    listen on 127.0.0.1 only, speak TLS with keys made for this call, and end with this process.

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
                # By default Dask gives up a worker that is not back after 15 s, and waits for ever.
                "distributed.deploy.lost-worker-timeout": f"{_RESTART:.0f} s",
                "distributed.worker.profile.enabled": False}  # its samples would fill the memory
    with dask.config.set(settings):
        cluster = LocalCluster(
            n_workers=workers or processors(), threads_per_worker=1, processes=True,
            host="127.0.0.1", dashboard_address="127.0.0.1:0",  # any free port and no dashboard
            scheduler_kwargs={"dashboard": False}, security=_security(),
            silence_logs=logging.CRITICAL)
        try:
            with Client(cluster) as client:
                client.register_plugin(_LeaveInterrupts())
                yield client
        finally:
            with suppress(AssertionError):  # it cannot end a worker that is just being started
                cluster.close()


def carry_out(jobs: Sequence[Job], client: Client, keep: Callable[[list[Outcome]], object],
              told: Callable[[int], object] = lambda count: None, batch: int | None = None,
              work: Work = run_batch) -> None:
    """Run all jobs and pass their outcomes to `keep`, batch by batch, as they finish.

    A job that kills its workers gets that as its outcome; other jobs of its batch are repeated.

    Parameters
    ----------
    told : called with the number of jobs finished since the last call.
    batch : number of jobs submitted together; by default up to LARGEST_BATCH.
    work : the function that runs a batch.

    Raises
    ------
    EngineError : the scheduler is lost, a worker has another version, or none has come back.
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
    # One at a time: when a worker dies, all jobs it holds are blamed.
    for (job,), outcomes in _results(client, work, [[job] for job in suspects], 0):
        keep(outcomes or [_deadly(job)])
        told(1)


def _results(client: Client, work: Work, batches: Sequence[Sequence[Job]], queued: int
             ) -> Iterator[tuple[Sequence[Job], list[Outcome] | None]]:
    """Yield each batch with its outcomes as it finishes, None if it killed its workers.

    At most `queued` batches per worker are submitted at a time, one in all if that is 0. Those that
    a scheduler forgets when the connection breaks are submitted anew once it answers again.
    """
    waiting, forgotten = iter(batches), 0
    running: dict[str, Sequence[Job]] = {}
    done = as_completed()

    def submit(part: Sequence[Job]) -> None:
        future = client.submit(work, part, digest(), pure=False)
        running[future.key] = part
        done.add(future)

    def fill() -> None:
        while len(running) < max(1, queued * _threads(client)) and (part := next(waiting, None)):
            submit(part)

    fill()
    while running:
        future = _next(done, client)
        part = running.pop(future.key)
        if future.status == "cancelled" and forgotten < _LOSSES * (len(running) + 1):
            _wait_for_scheduler(client)
            forgotten += 1
            submit(part)
            continue
        forgotten = 0
        yield part, _outcomes(future)
        future.release()
        fill()


def _wait_for_scheduler(client: Client) -> None:
    """Wait until the connection is there again; EngineError if it is not."""
    ends = time.monotonic() + _PATIENCE
    while client.status != "running":
        if client.status != "connecting" or time.monotonic() > ends:
            raise EngineError("the scheduler is lost; finished runs are kept")
        time.sleep(0.01)


def _next(done: as_completed, client: Client) -> Future:
    """Return the next future that is done; EngineError when no worker has come back."""
    seen = looked = time.monotonic()
    while not done.has_ready():
        time.sleep(0.01)
        now = time.monotonic()
        if now - looked > 2.0:
            looked = now
            if client.status != "running" or client.nthreads():
                seen = now
            elif now - seen > _RESTART:
                raise EngineError(f"no worker has come back for {_RESTART:.0f} s; the same "
                                  "command goes on from what is finished")
    return next(done)


def _outcomes(future: Future) -> list[Outcome] | None:
    """Return the outcomes of a batch, or None if it killed its workers."""
    if future.status == "finished":
        found: list[Outcome] = future.result()
        return found
    error = future.exception() if future.status == "error" else None
    if isinstance(error, KilledWorker):
        return None
    raise EngineError(f"{error or 'the scheduler is lost'}; finished runs are kept")


def _deadly(job: Job) -> Outcome:
    return Outcome(job.key, 0, None, "KilledWorker: every worker that started this run died",
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
