"""A dask cluster as the place of work: connecting, checking that its workers can take part, steps side by side."""

from __future__ import annotations

import logging
import pickle
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from linid.errors import ConfigError, LinidError, UsageError
from linid.workflow.cluster.work_process import ProcessDiedError
from linid.workflow.cluster.worker import Terms, do_item, look_at_scheduler, look_at_worker, own_versions, same
from linid.workflow.run.run_folder import RUN_FILE

if TYPE_CHECKING:
    from linid.workflow.run.reporter import Reporter
    from linid.workflow.run.request import Request

Item = TypeVar("Item")
Result = TypeVar("Result")
LOCAL = "local"
RETRIES = 2  # of work whose process has died on its worker
ANSWER_WITHIN = 30  # s, for the scheduler
WORKER_WITHIN = 60  # s, for the first worker
_FEW = 100  # input files that are looked for before the work begins; each task looks for its own
_OPTION = "--scheduler"


@dataclass(frozen=True)
class Cluster:
    """A connected dask cluster whose workers can take part. client: dask's; address: as given."""

    client: Any
    address: str
    terms: Terms

    def sharing(self, folder: Path, inputs: Sequence[str] = ()) -> Cluster:
        """The same for work whose results go to a folder that all workers must see, as they must some inputs.

        Raises ConfigError naming the worker that does not.
        """
        record = (folder / RUN_FILE).read_text(encoding="utf-8")
        shared = replace(self, terms=replace(self.terms, folder=str(folder.absolute()), record=record))
        shared.look(list(inputs)[:_FEW])
        return shared

    def look(self, inputs: Sequence[str] = ()) -> list[tuple[str, str]]:
        """Ask all workers whether they can take part; host and processor of each. Raises ConfigError."""
        answers = self.client.run(look_at_worker, self.terms, inputs, on_error="return")
        found = []
        for address, answer in answers.items():
            if isinstance(answer, BaseException):
                raise _cannot_load(f"worker {address}", answer)
            reason, host, processor = answer
            if reason is not None:
                raise ConfigError(f"worker {address}", *reason)
            found.append((host, processor))
        return found

    def map(self, function: Callable[[Item, int], Result], items: Sequence[Item]) -> Iterator[Result]:
        """function(item, threads) of every item on the workers, in order; function and items must be picklable.

        An item whose worker dies is done again by another. Raises what the function raises, and LinidError where
        workers die again and again or the scheduler goes away.
        """
        shared = self.client.submit(same, pickle.dumps(function), pure=False)
        futures = [self.client.submit(do_item, self.terms, shared, item, pure=False, retries=RETRIES) for item in items]
        try:
            for future in futures:
                try:
                    yield future.result()
                except Exception as error:
                    raise failure(self.address, error) from None
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self.client.cancel(futures)


@contextmanager
def connected(request: Request, reporter: Reporter) -> Iterator[Cluster | None]:
    """The cluster that a request asks for, None if it asks for none; disconnected (a local one: ended) afterwards.

    Raises UsageError where the extra is not installed or nothing answers at the address, ConfigError for a worker
    that cannot take part.
    """
    if request.scheduler is None or request.dry_run:
        yield None
        return
    try:
        import dask
        import distributed
    except ImportError:
        raise UsageError(
            f"{_OPTION} {request.scheduler}",
            "needs dask, which is not installed",
            'Install the extra: pip install "linid[cluster]"',
        ) from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    # A diagnosis sends its recordings once per step: tens of megabytes, and meant to.
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "1 GB"}):
        local = None
        if request.scheduler == LOCAL:
            local = distributed.LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=request.jobs,
                threads_per_worker=1,
                processes=True,
                memory_limit=0,
                dashboard_address=":0",
                silence_logs=logging.CRITICAL,
                preload=["linid.workflow.cluster.worker"],
            )
        try:
            client = _client(distributed, request.scheduler if local is None else local)
            try:
                yield _checked(client, request.scheduler, reporter)
            finally:
                with suppress(Exception):
                    client.close()
        finally:
            if local is not None:
                local.close(timeout=10)


def _client(distributed: Any, where: Any) -> Any:
    try:
        return distributed.Client(where, timeout=ANSWER_WITHIN, set_as_default=False)
    except (OSError, ValueError, ImportError) as error:
        raise UsageError(
            f"{_OPTION} {where}",
            f"no scheduler answers there ({_first_line(error)})",
            "Start one with `dask scheduler` and give the address that it prints, or take `local`.",
        ) from None


def _checked(client: Any, address: str, reporter: Reporter) -> Cluster:
    cluster = Cluster(client, address, Terms(f"linid-{uuid.uuid4().hex}", own_versions()))
    try:
        theirs = client.run_on_scheduler(look_at_scheduler)
    except Exception as error:
        raise _cannot_load(f"scheduler {address}", error) from None
    for name, version in cluster.terms.versions.items():
        if theirs.get(name) != version:
            raise ConfigError(
                f"scheduler {address}",
                f"has {name} {theirs.get(name, 'unknown')}, this program {version}",
                "Install the same there as here and start it again.",
            )
    try:
        client.wait_for_workers(1, timeout=WORKER_WITHIN)
    except TimeoutError:
        raise UsageError(
            f"{_OPTION} {address}",
            f"has no workers, {WORKER_WITHIN} s after it was asked",
            f"Start some: dask worker {address}",
        ) from None
    found = cluster.look()
    hosts, processors = ({one[k] for one in found} for k in (0, 1))
    reporter.say(f"{_count(len(found), 'worker')} on {_count(len(hosts), 'host')}")
    if _has_dashboard() and client.dashboard_link:
        reporter.say(f"dashboard: {client.dashboard_link}")
    if len(processors) > 1:
        reporter.warn(f"the workers' processors differ ({', '.join(sorted(processors))}): so may the last bits")
    return cluster


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' if number != 1 else ''}"


def is_killed_worker(future: Any) -> bool:
    """Whether a task was given up because workers died while they had it."""
    from distributed import KilledWorker

    return future.status == "error" and isinstance(future.exception(), KilledWorker)


def failure(address: str, error: BaseException) -> BaseException:
    """What went wrong with a task, in words where the cluster is to blame."""
    from concurrent.futures import CancelledError as Cancelled

    from distributed import CancelledError, KilledWorker

    if isinstance(error, KilledWorker):
        return LinidError(
            f"{_OPTION} {address}",
            f"{_count(error.allowed_failures + 1, 'worker')} died of the same work",
            "Look into the workers' logs; often their memory is too small. Go on by --resume.",
        )
    if isinstance(error, ProcessDiedError):
        return LinidError(
            f"{_OPTION} {address}",
            f"{error}, {RETRIES + 1} times",
            "Look at the memory of the workers' hosts. Go on by --resume.",
        )
    if isinstance(error, CancelledError | Cancelled | OSError) and not isinstance(error, LinidError):
        return LinidError(
            f"{_OPTION} {address}",
            f"the scheduler went away ({type(error).__name__})",
            "Start it again and go on by --resume.",
        )
    return error


def _cannot_load(place: str, error: BaseException) -> ConfigError:
    return ConfigError(
        place,
        f"cannot load this version of linid ({type(error).__name__}: {_first_line(error)})",
        "Install the same linid and Python there as here and start it again.",
    )


def _first_line(error: BaseException) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0].rstrip(".")


def _has_dashboard() -> bool:
    from importlib.util import find_spec

    return find_spec("bokeh") is not None
