"""Where submissions are graded: on this machine, or on a Dask cluster. Both are a `concurrent.futures.Executor`."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ThreadPoolExecutor, wait
from typing import Any

from muslin.base.child import Child
from muslin.base.errors import MuslinError
from muslin.classes.work import Job, Result, Terms, graded

#: How long to wait for a scheduler to answer [s].
ANSWER = 15.0


def results(
    executor: Executor, width: int, function: Callable[..., Result], terms: Terms, jobs: Iterable[Job]
) -> Iterator[Result]:
    """Results as they come; no more than `width` jobs are in memory at once.

    Yields
    ------
    Result
        One for every job; that of a job whose worker was lost says so.
    """
    running: dict[Future, str] = {}
    jobs = iter(jobs)
    exhausted = False
    while True:
        while not exhausted and len(running) < width:
            job = next(jobs, None)
            if job is None:
                exhausted = True
            else:
                running[executor.submit(function, terms, job)] = job.key
        if not running:
            return
        done, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in done:
            yield _result(future, running.pop(future))


def _result(future: Future, key: str) -> Result:
    try:
        return future.result()
    except CancelledError:
        return Result(key, error="The cluster gave it up: has its scheduler ended?", final=False)
    except Exception as error:
        text = str(error).splitlines()[:1] or [""]
        return Result(key, error=f"Its worker was lost: {type(error).__name__}: {text[0][:300]}", final=False)


@contextlib.contextmanager
def local(jobs: int) -> Iterator[tuple[Executor, int, Callable[..., Result]]]:
    """`jobs` processes at a time on this machine; none of them outlives this."""
    running: set[Child] = set()
    lock, stopped = threading.Lock(), threading.Event()

    def started(process: Child) -> None:
        with lock:
            running.add(process)
            if stopped.is_set():
                process.kill()

    def function(terms: Terms, job: Job) -> Result:
        return graded(terms, job, started)

    with ThreadPoolExecutor(jobs) as pool:
        try:
            yield pool, jobs, function
        except BaseException:
            stopped.set()
            pool.shutdown(wait=False, cancel_futures=True)
            with lock:
                for process in running:
                    process.kill()
            raise


@contextlib.contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, int, Callable[..., Result]]]:
    """The workers of a Dask scheduler.

    Raises
    ------
    MuslinError
        If Dask is not installed, nothing answers at the address, or there are no workers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise MuslinError(
            "To grade on a cluster, Dask is needed.", "Install it with: pip install 'muslin[class]'"
        ) from None
    try:
        client: Any = Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        said = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MuslinError(
            f"No Dask scheduler answers at {address} ({said}).",
            "Start one with: dask scheduler; and on each machine: dask worker ADDRESS --nthreads CORES",
        ) from None
    with client:
        threads = client.nthreads()
        if not threads:
            raise MuslinError(
                f"The scheduler at {address} has no workers.",
                f"On each machine: dask worker {address} --nthreads CORES",
            )
        width = sum(threads.values())
        with client.get_executor(pure=False, retries=1) as pool:
            yield pool, width + len(threads), graded
