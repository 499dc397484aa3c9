"""Functions that run in Dask's processes, and the address of the scheduler. Everything here is importable by name."""

from __future__ import annotations

import faulthandler
import fcntl
import os
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

import dask
from distributed import Security

from sprag_study.hosts import is_loopback
from sprag_study.worker import fingerprint, models
from sprag_study.worker.executors.known_answers import answers_of
from sprag_study.worker.limits import LOAD_SECONDS
from sprag_study.worker.pool.processes import within_processor_time
from sprag_study.worker.ports import ExecutorError
from sprag_study.worker.reports import processor

if TYPE_CHECKING:
    from collections.abc import Callable

_T = TypeVar("_T")

#: Seconds within which a nanny must end a worker.
END_SECONDS: Final = 20.0
#: Kernels that this worker process has loaded.
_loaded: set[models.KernelShape] = set()

#: Calls `introduce`, as an expression for ``eval``. A function would be imported as soon as its message arrives, so a
#: worker that cannot import Sprag would exit and be restarted endlessly without reporting why.
INTRODUCE: Final = "__import__('sprag_study.worker.executors.dask_tasks', fromlist=['']).introduce('{}')"


class OtherFingerprintError(Exception):
    """The process is not the one that was introduced at its address: it has another fingerprint."""


def introduce(discard: str) -> tuple[dict[str, str], str]:
    """Runs in each worker that joins: loads the engine and returns its fingerprint and the name of its processor.

    With ``discard`` the compiled kernels of its host are deleted first, once for each such text. A process that had
    loaded any of them exits, and its nanny starts another.
    """
    _discard_once(discard)
    if discard and _loaded:
        os._exit(0)
    models.prepare()
    return fingerprint.collect(), processor()


def load_kernel(
    expected: str, load: Callable[[models.KernelShape], str | None], shape: models.KernelShape, discard: str
) -> str | None:
    """Runs in each worker before its first chunk of a shape, and returns what ``load`` does.

    ``expected`` as in `run_chunk`, ``discard`` as in `introduce`.
    """
    _require(expected)
    _discard_once(discard)
    _loaded.add(shape)
    return _within(LOAD_SECONDS, partial(load, shape))


def load_and_answer(shape: models.KernelShape) -> str:
    """Load a kernel; returns a hash of its known answers.

    They are the same on every processor: other ones are those of a faulty processor or of a damaged cache.
    """
    models.load(shape)
    return answers_of(shape)


def _discard_once(token: str) -> None:
    if not token:
        return
    folder = models.cache_folder()
    with suppress(OSError), folder.with_name(f"{folder.name}.discarded").open("a+", encoding="ascii") as note:
        fcntl.flock(note, fcntl.LOCK_EX)
        note.seek(0)
        if note.read() != token:
            models.discard_compiled()
            note.truncate(0)
            note.write(token)


def run_chunk(
    expected: str,
    run: Callable[[models.ChunkTask], models.ChunkResult],
    task: models.ChunkTask,
    seconds: float,
    wall: float,
) -> models.ChunkResult:
    """Runs in a worker for each chunk, with limits of processor time and elapsed time (s).

    Raises OtherFingerprintError where the digest of the worker's fingerprint is not ``expected``.
    """
    _require(expected)
    return _within(wall, partial(within_processor_time, seconds, run, task))


def _require(expected: str) -> None:
    # An address says nothing: a process that was restarted on a fixed port has that of the one before.
    if fingerprint.digest() != expected:
        raise OtherFingerprintError(fingerprint.digest())


def _within(seconds: float, function: Callable[[], _T]) -> _T:
    """The value of the function; after ``seconds`` this process exits, whatever it is doing.

    The timer works without Python code, the scheduler or the submitter of the chunk.
    """
    with open(os.devnull, "w", encoding="ascii") as nowhere:
        faulthandler.dump_traceback_later(seconds, exit=True, file=nowhere)
        try:
            return function()
        finally:
            faulthandler.cancel_dump_traceback_later()


def scheduler_address(url: str) -> tuple[str, Security | None]:
    """Dask's address of the scheduler at ``dask://host:port``, with TLS unless it is on this machine.

    It has TLS there, too, where Dask's own configuration requires it. Raises ExecutorError when certificates are needed
    and that configuration names none.
    """
    place = url.removeprefix("dask://")
    if is_loopback(place.rpartition(":")[0]) and not dask.config.get("distributed.comm.require-encryption", None):
        return f"tcp://{place}", None
    security = Security(require_encryption=True)
    if not all(getattr(security, name) for name in ("tls_ca_file", "tls_client_cert", "tls_client_key")):
        raise ExecutorError(
            f"the scheduler {place} is spoken to by TLS, which needs certificates: set "
            "DASK_DISTRIBUTED__COMM__TLS__CA_FILE, DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and "
            "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY"
        )
    return f"tls://{place}", security


def blame_at_once(dask_scheduler: Any) -> None:
    """Runs in the scheduler: a task whose worker dies has failed."""
    dask_scheduler.allowed_failures = 0


async def end_worker(address: str, dask_scheduler: Any) -> None:
    """Runs in the scheduler: end the process of a worker, whatever it is doing, through its nanny."""
    await dask_scheduler.restart_workers(
        [address], timeout=END_SECONDS, wait_for_workers=False, on_error="return", stimulus_id=f"sprag-end-{address}"
    )
