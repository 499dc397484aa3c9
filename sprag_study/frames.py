"""The engine for notebooks: parameters as arrays or a frame in, characteristics as a frame with units out.

from sprag_study.frames import simulate

results = simulate({"excitation.frequency": [20.0, 25.0], ...})
results["shaft.speed.mean"], results.attrs["units"]["shaft.speed.mean"]  # rad/s
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pandas as pd

from sprag_study.engine import ENGINE_VERSION, Ending, Run, Span
from sprag_study.engine.catalogue import Parameter, ResultInfo
from sprag_study.engine.endings import ENDINGS
from sprag_study.engine.vibration_drive import simulate as _vibration_drive
from sprag_study.engine.vibration_drive.cases import pendulum_count
from sprag_study.engine.vibration_drive.parameters import PARAMETERS
from sprag_study.engine.vibration_drive.results import result_infos

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["ENGINE_VERSION", "Ending", "Run", "Span", "simulate"]

VIBRATION_DRIVE: Final = "vibration-drive"
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


def simulate(
    cases: Mapping[str, ArrayLike] | pd.DataFrame,
    run: Run | None = None,
    *,
    model: str = VIBRATION_DRIVE,
    base: Mapping[str, Any] | None = None,
) -> pd.DataFrame:
    """Run cases of a model in this process.

    Parameters
    ----------
    cases : mapping or DataFrame
        Paths of parameters (docs/reference.md) to numbers or arrays of shape (cases,), in SI units, frequency in Hz,
        angles in rad. Parameters without a default are required.
    run : Run, optional
        Duration, window, tolerance of a vibration drive; by default 60 periods, of which the last third is evaluated.
    model : str
        Name of the model, as in a spec.
    base : mapping, optional
        The machine of another model, as `base` of a spec: what ``cases`` do not give, such as the kind of a mechanism.

    Returns
    -------
    DataFrame
        A row for each case, with the index of ``cases`` where that is a frame: its ending and its results, NaN where
        one could not be computed. ``attrs["units"]`` has the unit of each result ("1" where it has none).

    Raises
    ------
    ValueError
        Where a path is unknown or missing, a value out of range, the arrays differ in length, or ``run`` or ``base`` is
        given for a model that does not take it.
    SpecError
        Where the machine of another model is invalid.
    """
    index = cases.index if isinstance(cases, pd.DataFrame) else None
    columns = {str(path): np.asarray(values, dtype=np.float64) for path, values in cases.items()}
    count = _count(columns) if index is None else len(index)
    if base is not None and model == VIBRATION_DRIVE:
        raise ValueError(f"base: not used by {model}, whose cases have every parameter")
    if run is not None and model != VIBRATION_DRIVE:
        raise ValueError(f"run: not used by {model}; only {VIBRATION_DRIVE} takes it")
    if model != VIBRATION_DRIVE:
        return _of_model(model, base or {}, columns, count, index)
    for path, values in columns.items():
        _check(path, values)
    batch = _vibration_drive.simulate(columns, run or Run(), cases=count)
    infos = result_infos(pendulum_count(columns))
    table: dict[str, Any] = {"ending": [ENDINGS[code].value for code in batch.endings.tolist()]}
    table |= {info.name: batch.values[:, number] for number, info in enumerate(infos)}
    return _framed(table, infos, index)


def _framed(table: dict[str, Any], infos: Sequence[ResultInfo], index: pd.Index | None) -> pd.DataFrame:
    frame = pd.DataFrame(table, index=index)
    frame.attrs["units"] = {info.name: info.unit for info in infos}
    return frame


def _of_model(
    model: str, base: Mapping[str, Any], columns: Mapping[str, np.ndarray], count: int, index: pd.Index | None
) -> pd.DataFrame:
    """Cases of any model, as those of a study of them."""
    from sprag_study.service.spec.document import parse_spec
    from sprag_study.worker import models

    axes = [{"path": path, "values": np.broadcast_to(values, count).tolist()} for path, values in columns.items()]
    study = parse_spec({"sprag": 1, "model": model, "base": base, "axes": axes, "combine": "zip"}).study
    rows, infos = models.run_chunk(study, 0, study.cases), models.model_results(study)
    table: dict[str, Any] = {"ending": list(rows.endings)}
    return _framed(table | {info.name: rows.values[:, k] for k, info in enumerate(infos)}, infos, index)


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
