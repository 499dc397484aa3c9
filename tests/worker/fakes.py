"""Stand-ins for the engine and the clock. Importable by name, because spawned processes look them up."""

from __future__ import annotations

import itertools
import os
import signal
import time
from collections.abc import Callable, Iterator
from collections.abc import Set as AbstractSet
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker import models
from sprag_study.worker.executors.process_pool import ProcessPoolExecutor
from sprag_study.worker.models import ChunkResult, ChunkTask, KernelShape
from sprag_study.worker.pool.child_process import uncounted
from sprag_study.worker.reports import ExecutorReport, Reporter, WorkerReport
from sprag_study.worker.study import Axis, Study

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.ports import Clock

BASE = {
    "excitation.frequency": 25.0,
    "excitation.amplitude_x": 2e-3,
    "excitation.amplitude_y": 2e-3,
    "pendulums.0.inertia": 1e-3,
    "pendulums.0.mass": 0.5,
    "pendulums.0.arm": 0.03,
    "pendulums.0.spring_rate": 9000.0,
    "pendulums.0.spring_arm": 0.05,
    "pendulums.0.damping": 0.01,
    "pendulums.0.backlash": 0.005,
    "shaft.inertia": 2e-3,
    "shaft.load": 0.1,
    "clutch.coefficients.0": 0.0,
    "clutch.coefficients.1": 200.0,
    "clutch.coefficients.2": 0.0,
    "clutch.coefficients.3": 20000.0,
}
RUN = {"duration": [3.0, "periods"], "window": None, "tolerance": 1e-9, "reset": "contact"}
RESULTS = len(models.result_infos("vibration-drive", "1"))


def study(cases: int, name: str = "a study", tolerance: float = 1e-9) -> Study:
    """A study of that many cases over the load."""
    loads = tuple((np.arange(cases) * 1e-3).tolist())
    return Study("vibration-drive", name, dict(BASE), RUN | {"tolerance": tolerance}, (Axis(("shaft.load",), loads),))


def values(first: int, count: int) -> NDArray[np.float64]:
    """Numbers that tell which case they are of: shape (count, results)."""
    cases = np.arange(first, first + count, dtype=np.float64)[:, None]
    return np.ascontiguousarray(cases * 1000.0 + np.arange(RESULTS))


def result(first: int, count: int, ending: str = models.OK) -> ChunkResult:
    """The result of a chunk whose cases all end in the same way."""
    return ChunkResult(first, [ending] * count, [""] * count, values(first, count))


def report(*workers: WorkerReport, shortage: str = "", **cases: int) -> dict[str, Any]:
    """What a dispatcher reports of workers of a cluster that have run ``cases`` on their hosts."""
    found = ExecutorReport("dask", workers, cases, shortage, "tls://head:8786", "http://head:8787/status")
    return Reporter().summary(found, 0, 0.0)


def run(
    task: ChunkTask, *, crash: frozenset[int] = frozenset(), hang: frozenset[int] = frozenset(), failing: bool = False
) -> ChunkResult:
    """Run a chunk at once; cases in ``crash`` take the process with them, those in ``hang`` never come back."""
    for case in range(task.first, task.first + task.count):
        if case in crash:
            os.kill(os.getpid(), signal.SIGKILL)
        if case in hang:
            signal.pause()
    return result(task.first, task.count, models.Ending.DIVERGED if failing else models.OK)


def run_slowly(task: ChunkTask, *, seconds: float) -> ChunkResult:
    """Run a chunk in so many seconds."""
    time.sleep(seconds)
    return result(task.first, task.count)


def spinning(task: ChunkTask) -> ChunkResult:
    """Never comes back, and uses all the processor time it can get."""
    while True:
        pass


def run_beside(task: ChunkTask, *, folder: str) -> ChunkResult:
    """Run a chunk by the engine, once the workers of both kinds of processors have one.

    Each writes the features by which its numpy chooses into a file.
    """
    Path(folder, str(os.getpid())).write_text(" ".join(numpy_features()), encoding="ascii")
    while len(os.listdir(folder)) < 2:
        time.sleep(0.02)
    return models.run_task(task)


def run_between(task: ChunkTask, *, begun: str, told: str) -> ChunkResult:
    """Say into ``begun`` that the chunk began; it is through when somebody writes into ``told``."""
    load_between(task.shape, begun=begun, told=told)
    return result(task.first, task.count)


def raising(task: ChunkTask) -> ChunkResult:
    """A fault of the program in every chunk."""
    raise ZeroDivisionError("no such thing")


def load(shape: KernelShape) -> None:
    """No kernel is needed."""


def load_answering(shape: KernelShape, *, folder: str) -> str:
    """The kernel of the first worker that loads one gives other answers than those of the others."""
    with suppress(FileExistsError):
        Path(folder, "first").touch(exist_ok=False)
        return "ones"
    return "others"


#: A file in the cache that stands for a damaged kernel.
DAMAGED = "damaged.nbc"
_in_hand = False


def load_damaged(shape: KernelShape) -> None:
    """Take the kernel in hand, damaged or not."""
    global _in_hand  # noqa: PLW0603 - as compiled code stays in a process
    _in_hand = _in_hand or (models.cache_folder() / DAMAGED).exists()


def load_or_die(shape: KernelShape) -> None:
    """Load the kernel; a damaged one takes the process with it."""
    load_damaged(shape)
    if _in_hand:
        os.kill(os.getpid(), signal.SIGKILL)


def run_or_die(task: ChunkTask) -> ChunkResult:
    """Run a chunk at once; where the kernel in hand is damaged it takes the process with it."""
    if _in_hand:
        os.kill(os.getpid(), signal.SIGKILL)
    return result(task.first, task.count)


def nothing_compiled(shape: KernelShape) -> bool:
    """The cache on disk is empty."""
    return False


def load_when_told(shape: KernelShape, *, tolerance: float, fifo: str) -> None:
    """The kernel of that tolerance is there when somebody writes into ``fifo``; the others at once."""
    if shape.key[-1] == tolerance:
        with open(fifo, encoding="ascii") as told:
            told.read()


def load_between(shape: KernelShape, *, begun: str, told: str) -> None:
    """Say into ``begun`` that the compilation began; the kernel is there when somebody writes into ``told``."""
    with open(begun, "w", encoding="ascii") as say:
        say.write("begun")
    with open(told, encoding="ascii") as wait:
        wait.read()


def load_never(shape: KernelShape) -> None:
    """A compilation without end."""
    signal.pause()


def load_dies(shape: KernelShape) -> None:
    """A compiler that takes its process with it."""
    os.kill(os.getpid(), signal.SIGKILL)


def die_at_first(trace: str, number: int) -> str:
    """End the process by a signal, unless the file ``trace`` is there already."""
    path = Path(trace)
    if not path.exists():
        path.touch()
        signal.raise_signal(number)
    return "alive"


def load_fails(shape: KernelShape) -> None:
    """A compiler that gives up."""
    raise ZeroDivisionError("no such kernel")


def prepare() -> None:
    """Nothing needs to be ready."""


def interrupt() -> None:
    """Ctrl-C while a process starts."""
    os.kill(os.getpid(), signal.SIGINT)


def broken() -> None:
    """A process that dies as soon as it starts."""
    os._exit(7)


def pool(
    processes: int = 2,
    *,
    chunk_timeout: float = 600.0,
    run: Callable[[ChunkTask], ChunkResult] = run,
    load: Callable[[KernelShape], None] = load,
    compiled: Callable[[KernelShape], bool] = nothing_compiled,
    prepare: Callable[[], None] = prepare,
    load_timeout: float = 600.0,
) -> ProcessPoolExecutor:
    """A process pool without the engine."""
    return ProcessPoolExecutor(
        processes,
        chunk_timeout=chunk_timeout,
        run=run,
        load=load,
        compiled=compiled,
        prepare=prepare,
        load_timeout=load_timeout,
        wall_timeout=chunk_timeout,
    )


def faulty(**faults: frozenset[int]) -> partial[ChunkResult]:
    """`run` with faults, to give to an executor."""
    return partial(run, **faults)


class Present:
    """Dispatchers that are there until they are said to be gone."""

    def __init__(self) -> None:
        self.epochs: set[int] = set()

    def enter(self, epoch: int) -> None:
        self.epochs.add(epoch)

    def present(self) -> AbstractSet[int]:
        return self.epochs


class HandClock:
    """A clock that stands still until it is moved."""

    def __init__(self) -> None:
        self.seconds = 0.0

    def now(self) -> datetime:
        return datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=self.seconds)

    def monotonic(self) -> float:
        return self.seconds


@contextmanager
def clocked(store: Store, clock: Clock) -> Iterator[None]:
    """Let a store that is open already go by another clock."""
    having = [part for part in (store, *vars(store).values()) if hasattr(part, "clock")]
    before = store.clock
    for part in having:
        part.clock = clock
    yield
    for part in having:
        part.clock = before


def prepare_nothing() -> None:
    """What a process does first that needs nothing."""


def tell_and_wait(told: str) -> None:
    """Write the id of the process to a pipe, and never come back."""
    with open(told, "w", encoding="ascii") as pipe:
        pipe.write(str(os.getpid()))
    while True:
        signal.pause()


def leave_a_trace(folder: str) -> None:
    """A file of the name of the process."""
    (Path(folder) / str(os.getpid())).touch()


def fail_while_loading() -> None:
    """What is to be loaded is damaged."""
    with uncounted():
        raise ZeroDivisionError


def numpy_features() -> list[str]:
    """The features of this processor by which numpy chooses its code, without those that a setting disables."""
    return [str(name) for name in np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])]


def of_any_processor() -> dict[str, str]:
    """The environment in which numpy and the C library take their code for any processor."""
    return {
        "NPY_DISABLE_CPU_FEATURES": " ".join(numpy_features()),
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
    }


def numbered(count: int, size: int = 1, broken: bool = False) -> Iterator[bytes]:
    """Pieces that begin with their number, without an end where ``count`` is 0; ``broken`` fails at the end."""
    for number in itertools.count() if count == 0 else range(count):
        yield b"%d " % number + b"." * size
    if broken:
        raise ValueError("broken")
