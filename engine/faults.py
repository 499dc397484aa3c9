"""Deliberate faults for tests: cases that crash their process and cases that never return.

They occur only if the environment of the process has both variables::

    SPRAG_FAULTS_ALLOWED=yes
    SPRAG_FAULTS="crash shaft.load=0.25,0.75; hang shaft.load=0.5"

A case is hit when its parameter has one of the values (SI, equal to twelve digits).
"""

import math
import os
import signal
from collections.abc import Mapping
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

ALLOWED_VARIABLE = "SPRAG_FAULTS_ALLOWED"
FAULTS_VARIABLE = "SPRAG_FAULTS"
_PRECISION = 1e-12


def inject(columns: Mapping[str, ArrayLike], cases: int) -> None:
    """Crash or hang this process if the environment requests it for one of the cases.

    Parameters
    ----------
    columns : mapping
        Paths in a spec to scalars or arrays of shape (cases,), in SI units.
    cases : int

    Raises
    ------
    ValueError
        If the variable cannot be parsed.
    """
    wanted = os.environ.get(FAULTS_VARIABLE)
    if not wanted or os.environ.get(ALLOWED_VARIABLE) != "yes":
        return
    for clause in wanted.split(";"):
        fault, path, values = _parsed(clause)
        column = np.broadcast_to(np.asarray(columns.get(path, math.nan), dtype=np.float64), (cases,))
        if any(np.isclose(column, value, rtol=_PRECISION, atol=0.0).any() for value in values):
            _crash() if fault == "crash" else _hang()


def _parsed(clause: str) -> tuple[str, str, list[float]]:
    fault, _, rest = clause.strip().partition(" ")
    path, _, values = rest.partition("=")
    if fault not in ("crash", "hang"):
        raise ValueError(f"{FAULTS_VARIABLE}: {clause!r} is not a fault such as 'crash shaft.load=0.25,0.75'")
    return fault, path.strip(), [float(value) for value in values.split(",")]


def _crash() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _hang() -> NoReturn:
    while True:
        signal.pause()
