"""Runs on many machines: the only module that knows Dask."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from threading import Lock

from hierarchy import plugins
from hierarchy.errors import HierarchyError, naming
from scenarios.results.plan import Job, Outcome, digest

_PATIENCE = 30.0  # [s] for a scheduler to answer and to have a worker
_ONE_AT_A_TIME = Lock()  # the kernels' work arrays are shared by the threads of a worker


class ClusterError(RuntimeError):
    """The sweep cannot continue: the scheduler is lost, or a worker has another version."""


def ended(work: Callable[[Job], Outcome], jobs: Sequence[Job], scheduler: str
          ) -> Iterator[tuple[Job, Outcome | None]]:
    """Yield each job with its outcome as it ends on workers of the Dask scheduler at an address.

    The outcome is None if a job killed its workers.

    Raises
    ------
    HierarchyError : Dask is not installed, no scheduler answers, or it has no workers.
    ClusterError : the scheduler is lost, or a worker has another version of the code.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ImportError as error:
        raise HierarchyError("--scheduler needs dask.distributed: "
                             "pip install 'task-hierarchy[sweep]'") from error
    with naming(f"no Dask scheduler answers at {scheduler}", of=(OSError, ValueError, TypeError)):
        client = Client(scheduler, timeout=_PATIENCE)
    with client:
        try:
            client.wait_for_workers(1, timeout=_PATIENCE)
        except TimeoutError:
            raise HierarchyError(f"the Dask scheduler at {scheduler} has no workers") from None
        futures = client.map(partial(_checked, work, digest()), jobs, pure=False)
        job_of = {future.key: job for future, job in zip(futures, jobs, strict=True)}
        for future in as_completed(futures):
            broken = future.exception() if future.status == "error" else None
            if future.status != "finished" and not isinstance(broken, KilledWorker):
                raise ClusterError(f"{broken or 'the scheduler is lost'}; finished runs are kept")
            yield job_of[future.key], None if broken else future.result()
            future.release()


def _checked(work: Callable[[Job], Outcome], versions: str, job: Job) -> Outcome:
    """Run a job on a worker; raises ClusterError unless its code is that of the client."""
    for module in job.plugins:
        plugins.allow(module)
    if digest() != versions:
        raise ClusterError("a worker has other versions of task-hierarchy or its dependencies than "
                           "this machine; install the same on both")
    with _ONE_AT_A_TIME:
        return work(job)
