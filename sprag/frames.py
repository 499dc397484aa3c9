"""The engine for notebooks: parameters as arrays or a frame in, characteristics as a frame with units out.

from sprag.frames import simulate

results = simulate({"excitation.frequency": [20.0, 25.0], ...})
results["shaft.speed.mean"], results.attrs["units"]["shaft.speed.mean"]  # rad/s
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd

from sprag.engine import ENGINE_VERSION, Ending, Run, Span
from sprag.engine.catalogue import Parameter
from sprag.engine.endings import ENDINGS
from sprag.engine.vibration_drive import simulate as _vibration_drive
from sprag.engine.vibration_drive.cases import pendulum_count
from sprag.engine.vibration_drive.parameters import PARAMETERS
from sprag.engine.vibration_drive.results import result_infos

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["ENGINE_VERSION", "Ending", "Run", "Span", "simulate"]

#: Parameters of a clutch law, common or of one pendulum; the ranges are those of a spec.
_CLUTCH: Final = (
    Parameter("clutch.coefficients.K", "c_k", "N*m/rad^K", -1e30, 1e30, False, None, "clutch polynomial"),
    Parameter("clutch.windup_limit", "u_max", "rad", 0.0, math.inf, True, math.inf, "largest windup measured"),
)
_PATTERNS: Final = [
    (re.compile(re.escape(parameter.path).replace("N", r"\d+")), parameter) for parameter in PARAMETERS
] + [
    (re.compile(r"(pendulums\.\d+\.)?" + re.escape(parameter.path).replace("K", r"\d+")), parameter)
    for parameter in _CLUTCH
]


def simulate(cases: Mapping[str, ArrayLike] | pd.DataFrame, run: Run | None = None) -> pd.DataFrame:
    """Run cases of the vibration drive in this process.

    Parameters
    ----------
    cases : mapping or DataFrame
        Paths of parameters (docs/reference.md) to numbers or arrays of shape (cases,), in SI units, frequency in Hz,
        angles in rad. Parameters without a default are required.
    run : Run, optional
        Duration, window, tolerance; by default 60 periods, of which the last third is evaluated.

    Returns
    -------
    DataFrame
        A row for each case, with the index of ``cases`` where that is a frame: its ending and its results, NaN where
        one could not be computed. ``attrs["units"]`` has the unit of each result ("1" where it has none).

    Raises
    ------
    ValueError
        Where a path is unknown or missing, a value out of range, or the arrays differ in length.
    """
    index = cases.index if isinstance(cases, pd.DataFrame) else None
    columns = {str(path): np.asarray(values, dtype=np.float64) for path, values in cases.items()}
    count = _count(columns) if index is None else len(index)
    for path, values in columns.items():
        _check(path, values)
    batch = _vibration_drive.simulate(columns, run or Run(), cases=count)
    infos = result_infos(pendulum_count(columns))
    table: dict[str, Any] = {"ending": [ENDINGS[code].value for code in batch.endings.tolist()]}
    table |= {info.name: batch.values[:, number] for number, info in enumerate(infos)}
    frame = pd.DataFrame(table, index=index)
    frame.attrs["units"] = {info.name: info.unit for info in infos}
    return frame


def _count(columns: Mapping[str, np.ndarray]) -> int:
    """Number of cases; raises ValueError where arrays differ in length."""
    lengths = {path: len(values) for path, values in columns.items() if values.ndim == 1}
    if len(set(lengths.values())) > 1:
        raise ValueError("arrays differ in length: " + ", ".join(f"{path} {n}" for path, n in lengths.items()))
    return next(iter(lengths.values()), 1)


def _check(path: str, values: np.ndarray) -> None:
    """Raise ValueError where a path is unknown or one of its values is out of range."""
    parameter = next((parameter for pattern, parameter in _PATTERNS if pattern.fullmatch(path)), None)
    if parameter is None:
        raise ValueError(f"{path} is not a parameter of the vibration drive")
    if values.ndim > 1:
        raise ValueError(f"{path} must be a number or an array of one dimension, not of {values.ndim}")
    for number, value in enumerate(np.atleast_1d(values).tolist()):
        if not parameter.accepts(value) and value != parameter.default:
            raise ValueError(f"{path} is {value:g} in case {number}; allowed: {parameter.range_text()}")
