"""Who does the jobs of a run: this process, some processes of this machine, or a Dask cluster."""

from __future__ import annotations

import asyncio
import atexit
import concurrent.futures
import logging
import multiprocessing
import os
import signal
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, ExitStack, nullcontext, suppress
from multiprocessing.synchronize import Semaphore
from pathlib import Path
from types import FrameType, TracebackType
from typing import Any, ClassVar, Protocol, TypeVar

import psutil

from notabug.adapters.trees import remove
from notabug.results.document import JobsSaid
from notabug.scenes_usd.cache_folder import CacheError, cache_root
from notabug.scenes_usd.errors import NotabugError, SelectionError

Job = TypeVar("Job")
Made = TypeVar("Made")
GRACE = 5.0  # seconds in which a process that is told to end must have done so
_ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL")}
_NEEDED = "notabug.runs.preload"
JOBS_PER_PROCESS = 4  # a process takes some seconds to start: with fewer jobs for it, it is not worth starting


class ClusterLostError(NotabugError):
    """The cluster that did the jobs of a run is out of reach."""


class Workers(Protocol):
    """Does jobs, ``at_once`` at a time."""

    at_hand: ClassVar[bool]
    """Jobs are done in this process, so that they can be watched."""

    @property
    def at_once(self) -> int: ...

    def document(self) -> JobsSaid:
        """The ``jobs`` entry of ``run.json``."""
        ...

    def each(self, function: Callable[[Job], Made], jobs: Sequence[Job]) -> Iterator[tuple[int, Made | Exception]]:
        """Each job's number and what ``function`` made of it, in the order in which they end."""
        ...

    def __enter__(self) -> Workers: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Alone:
    """Jobs one after the other in this process."""

    at_hand: ClassVar[bool] = True
    at_once = 1

    def document(self) -> JobsSaid:
        return {"executor": "this process", "at_once": 1}

    def each(self, function: Callable[[Job], Made], jobs: Sequence[Job]) -> Iterator[tuple[int, Made | Exception]]:
        for index, job in enumerate(jobs):
            made: Made | Exception
            try:
                made = function(job)
            except Exception as error:
                made = error
            yield index, made

    def __enter__(self) -> Alone:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        return None


class Processes:
    """Jobs in processes of this machine, ``at_once`` of which may have a renderer at work.

    There are half as many processes again, which judge meanwhile: renderers wait for files and for their children.
    When a process dies the jobs that were in hand are done again, each alone, so that the one at fault is known: it
    is given up when it costs a second process, the others are not blamed.
    """

    at_hand: ClassVar[bool] = False

    def __init__(self, at_once: int, threads: int) -> None:
        self.at_once = at_once
        self._hands = at_once + (at_once + 1) // 2
        self._threads = threads
        self._pool: ProcessPoolExecutor | None = None

    def document(self) -> JobsSaid:
        return {"executor": "processes", "at_once": self.at_once}

    def each(self, function: Callable[[Job], Made], jobs: Sequence[Job]) -> Iterator[tuple[int, Made | Exception]]:
        waiting = deque(range(len(jobs)))
        suspects: deque[int] = deque()
        while waiting:
            yield from self._round(function, jobs, waiting, suspects, self._hands)
            while suspects:
                alone, found = deque([suspects.popleft()]), deque[int]()
                yield from self._round(function, jobs, alone, found, 1)
                for index in found:
                    yield (
                        index,
                        NotabugError(
                            "two processes died while they did it", where="this job", do="is there memory enough?"
                        ),
                    )

    def _round(
        self,
        function: Callable[[Job], Made],
        jobs: Sequence[Job],
        waiting: deque[int],
        suspects: deque[int],
        hands: int,
    ) -> Iterator[tuple[int, Made | Exception]]:
        """Do the ``waiting`` jobs until they are done or a process dies; then ``suspects`` gets those in hand."""
        pool = self._open()
        running: dict[Future[Made], int] = {}
        while running or waiting:
            while waiting and len(running) < hands:
                index = waiting.popleft()
                try:
                    running[pool.submit(_guarded, function, jobs[index])] = index
                except BrokenProcessPool:
                    waiting.appendleft(index)
                    break
            ended, _ = concurrent.futures.wait(running, return_when=concurrent.futures.FIRST_COMPLETED)
            broken = not ended
            for future in ended:
                index, error = running.pop(future), future.exception()
                if isinstance(error, BrokenProcessPool):
                    suspects.append(index)
                    broken = True
                elif isinstance(error, Exception):
                    yield index, error
                elif error is not None:
                    raise error
                else:
                    yield index, future.result()
            if broken:
                suspects.extend(running.values())
                self._close()
                return

    def _open(self) -> ProcessPoolExecutor:
        if self._pool is None:
            context = multiprocessing.get_context(prepare())
            # a new pool has new places: a process that was killed may have had one
            places = context.Semaphore(self.at_once)
            pool: Any = ProcessPoolExecutor(self._hands, context, _begin, (self._threads, places))
            # All start with the first job, not each with a job of its own: a pool that breaks while one starts either
            # waits for it for ever or fails in `submit`, as its queue is closed.
            pool._safe_to_dynamically_spawn_children = False
            self._pool = pool
        return self._pool

    def _close(self, *, wait: bool = True) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=wait, cancel_futures=True)
            self._pool = None

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and self._pool is not None:  # interrupted: what is in hand is dropped, renderers end
            for each in list((getattr(self._pool, "_processes", None) or {}).values()):
                each.terminate()
        self._close(wait=error is not None)  # processes without a job end by themselves


def prepare(*more: str) -> str:
    """Start, where there is none yet, the process that workers are forked from; how they start: "forkserver", "spawn".

    It loads what a job needs, and the modules ``more``, which takes a second or more, while this process goes on, and
    does nothing else: unlike this process it has no threads, whose locks a fork would leave locked.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return "spawn"
    from multiprocessing import forkserver

    forkserver.set_forkserver_preload([_NEEDED, *more])
    if not _own_temporary_folder():
        return "spawn"  # whose processes are reached by pipes, which have no path
    with suppress(CacheError):  # where a temporary cache is needed all processes share one; who uses it tells the error
        cache_root()
    before = {name: os.environ.get(name) for name in _ONE_THREAD}
    os.environ.update(_ONE_THREAD)
    try:
        forkserver.ensure_running()
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    return "forkserver"


_LONGEST = 85  # bytes of a folder's path that leave room for "/listener-" and eight letters: macOS allows 104
_SOCKETS = "notabug-work-"  # and a process's number: the temporary folder of its sockets
_SHORT = ("/tmp", "/var/tmp")  # noqa: S108 (mkdtemp makes a folder in it) for where TMPDIR is too long for a socket


def _own_temporary_folder() -> bool:
    """Have multiprocessing keep its sockets in a folder that tells whose it is, and remove those of the dead.

    A process that is killed cannot remove its own. False where no folder has a path that is short enough.
    """
    configuration = getattr(multiprocessing.current_process(), "_config", {})
    if configuration.get("tempdir") is not None:
        return len(os.fsencode(configuration["tempdir"])) <= _LONGEST
    for place in dict.fromkeys((tempfile.gettempdir(), os.environ.get("XDG_RUNTIME_DIR", ""), *_SHORT)):
        if not place:
            continue
        with suppress(OSError):
            _remove_sockets_of_the_dead(Path(place))
            folder = tempfile.mkdtemp(prefix=f"{_SOCKETS}{os.getpid()}-", dir=place)
            if len(os.fsencode(folder)) > _LONGEST:
                remove(Path(folder))
                continue
            configuration["tempdir"] = folder
            atexit.register(_remove_own, Path(folder), os.getpid())
            return True
    return False


def _remove_sockets_of_the_dead(place: Path) -> None:
    for path in place.glob(f"{_SOCKETS}*"):
        number = path.name.removeprefix(_SOCKETS).partition("-")[0]
        if number.isdecimal() and not psutil.pid_exists(int(number)) and path.stat().st_uid == os.geteuid():
            remove(path)


def _remove_own(folder: Path, process: int) -> None:
    if os.getpid() == process:  # and not a child that was forked
        with suppress(OSError):
            remove(folder)


_places: Semaphore | None = None


def rendering() -> AbstractContextManager[object]:
    """Where a job has its renderer at work: in a worker process no more than ``at_once`` jobs are here."""
    return _places or nullcontext()


def _begin(threads: int, places: Semaphore) -> None:
    """The start of a process: libraries may use ``threads``; it ends, and its renderers too, when its parent does."""
    global _places
    _places = places
    os.environ["OMP_NUM_THREADS"] = str(threads)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent hears it too and decides
    signal.signal(signal.SIGTERM, _end)
    threading.Thread(target=_outlive, daemon=True).start()


def _end(number: int, frame: FrameType | None) -> None:
    """End by an exception, so that what guards a renderer ends it; and end, whoever catches it."""
    del frame
    last = threading.Timer(GRACE, os._exit, (128 + number,))
    last.daemon = True
    last.start()
    sys.exit(128 + number)


def _guarded(function: Callable[[Job], Made], job: Job) -> Made:
    """``function(job)``; the pool's own loop would take an exit for a result and go on."""
    try:
        return function(job)
    except SystemExit as stop:
        os._exit(stop.code if isinstance(stop.code, int) else 1)


def _outlive() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os.kill(os.getpid(), signal.SIGTERM)


class Cluster:
    """Jobs on the Dask cluster whose scheduler is at ``address``; its workers share the run's folder.

    A worker that dies costs nothing but time: Dask gives its jobs to another one, up to three times.
    """

    at_hand: ClassVar[bool] = False

    def __init__(self, address: str) -> None:
        self._address = address
        self._stack = ExitStack()
        self._executor: Executor | None = None
        self._lost = False
        self.at_once = 1

    def document(self) -> JobsSaid:
        return {"executor": f"dask://{self._address}", "at_once": self.at_once}

    def each(self, function: Callable[[Job], Made], jobs: Sequence[Job]) -> Iterator[tuple[int, Made | Exception]]:
        if self._executor is None:
            raise RuntimeError("the cluster is not open")
        try:
            futures = {self._executor.submit(function, job): index for index, job in enumerate(jobs)}
            for future in concurrent.futures.as_completed(futures):
                error = future.exception()
                if error is not None and not isinstance(error, Exception):
                    raise error
                yield futures[future], future.result() if error is None else error
        except (concurrent.futures.CancelledError, asyncio.CancelledError, OSError) as error:
            self._lost = True
            raise ClusterLostError(
                "the Dask scheduler is out of reach",
                where=f"--executor dask://{self._address}",
                got=type(error).__name__,
                do="start it again, and run the same command: it goes on from the finished results",
            ) from error

    def __enter__(self) -> Cluster:
        try:
            import distributed
        except ImportError:
            raise SelectionError(
                "Dask is not installed", where="--executor", do="pip install 'notabug[dask]'"
            ) from None
        _silence("distributed", "tornado", "asyncio")  # which tell of a lost scheduler in many traces
        try:
            dask: Any = distributed
            client = self._stack.enter_context(dask.Client(f"tcp://{self._address}", timeout=10))
        except OSError as error:
            what = "no Dask scheduler answers"
            raise SelectionError(what, where=f"--executor dask://{self._address}", got=str(error)) from error
        self.at_once = max(1, sum(client.nthreads().values()))
        self._executor = client.get_executor(pure=False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._lost:  # whatever closing it says is no news
            with suppress(Exception):
                self._stack.close()
            return
        if self._executor is not None:
            self._executor.shutdown(wait=error is None)  # without waiting it drops what is not done
        self._stack.close()


def _silence(*packages: str) -> None:
    """Let the loggers of ``packages``, which have levels and handlers of their own, say nothing."""
    for name in [*packages, *logging.root.manager.loggerDict]:
        if name.partition(".")[0] in packages:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def workers_for(executor: str, at_once: int, jobs: int) -> tuple[Workers, int]:
    """The workers for a run of ``jobs`` jobs and the threads for each; ``at_once`` 0: as many as are good.

    By default each renderer has a core of its own while several are at work, so that they do not slow each other
    down; a lone job has all cores.
    """
    if executor:
        kind, separator, address = executor.partition("://")
        if kind != "dask" or not separator or not address:
            raise SelectionError("no such executor", where="--executor", expected="dask://host:port", got=executor)
        return Cluster(address), 1
    cores = cores_here()
    at_once = at_once or max(1, min(cores, jobs // JOBS_PER_PROCESS))
    threads = max(1, cores // at_once)
    return (Alone(), 0) if at_once == 1 else (Processes(at_once, threads), threads)


def cores_here() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
