"""The kernels that several files of tests need, compiled once: ``python -m tests.kernels``.

The processes that run the tests, and the pools that these start, would each compile them anew. A kernel that a single
file needs is compiled there.
"""

from __future__ import annotations

from sprag_study.worker import models
from sprag_study.worker.models import KernelShape
from sprag_study.worker.models.machine_shaft.model import MODEL, SHAPE
from sprag_study.worker.models.vibration_drive.model import DriveKey

#: By pendulums, clutch coefficients and tolerance; torques that depend on speeds, and loads that are no polynomials.
DRIVES = (
    DriveKey(1, 4, 1e-9),
    DriveKey(2, 4, 1e-9),
    DriveKey(3, 4, 1e-9),
    DriveKey(1, 4, 1e-11),
    DriveKey(1, 4, 1e-9, drag=True),
    DriveKey(2, 4, 1e-9, drag=True),
    DriveKey(1, 4, 1e-9, curved=True),
    DriveKey(2, 4, 1e-9, curved=True),
)
SHAFTS = (SHAPE, KernelShape(MODEL, ("transient",)))


def main() -> None:
    """Compile them into the cache, or load them from there."""
    for shape in (*SHAFTS, *(key.shape for key in DRIVES)):
        models.load(shape)


if __name__ == "__main__":
    main()
