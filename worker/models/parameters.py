"""The parameter at a flat path of a spec, from the catalogue of its model, and which values it allows."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.formulas import evaluate
from sprag_study.worker.models.registry import model_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import ArrayLike, NDArray

    from sprag_study.engine.catalogue import Parameter
    from sprag_study.worker.study import Study

_INDEX: Final = re.compile(r"\.(\d+)(?=\.|$)")


def general_path(path: str) -> str:
    """``path`` with the catalogue's letters for its indices: ``pendulums.1.mass`` -> ``pendulums.N.mass``."""
    return _INDEX.sub(lambda match: ".N" if path[: match.start()].endswith(("pendulums", "parts")) else ".K", path)


def model_parameter(model: str, path: str) -> Parameter | None:
    """The entry of ``model``'s catalogue for a flat path of a spec; None when there is no such parameter."""
    general = general_path(path)
    # The clutch of one pendulum has the parameters of a common clutch, each part of a shaft those of the only one.
    wanted = {general, general.removeprefix("parts.N.")}
    if ".clutch." in general:
        wanted.add(general.removeprefix("pendulums.N."))
    return next((entry for entry in model_of(model).parameters() if entry.path in wanted), None)


def parameter_of(study: Study, path: str) -> Parameter | None:
    """The parameter at a flat path of a spec, for the machine of ``study``; None when there is none.

    Components have one for their number, whose unit is their names, and for their own numbers.
    """
    of_components = next((known for one in study.components if (known := one.parameter(path)) is not None), None)
    if of_components is not None:
        return of_components
    own = model_of(study.model).parameters_of(study)
    return own.get(path) if own else model_parameter(study.model, path)


def coefficient_unit(index: int) -> str:
    """Unit of the clutch coefficient at ``index`` (0 is c_1): "N*m", "N*m/rad", "N*m/rad^2", .."""
    return "N*m" + ("" if index == 0 else "/rad" if index == 1 else f"/rad^{index}")


def placed(parameter: Parameter, path: str) -> Parameter:
    """The catalogue's ``parameter`` at the flat ``path``, with indices filled in, also in its unit."""
    unit = coefficient_unit(int(path.rsplit(".", 1)[-1])) if parameter.unit.endswith("^K") else parameter.unit
    return replace(parameter, path=path, unit=unit)


def in_range(values: NDArray[np.float64], parameter: Parameter) -> NDArray[np.bool_]:
    """Which values (SI) are finite and in the range of ``parameter``; the vector form of `Parameter.accepts`."""
    above = values > parameter.low if parameter.low_open else values >= parameter.low
    return np.isfinite(values) & above & (values <= parameter.high)


def refused_cases(study: Study, columns: Mapping[str, ArrayLike], count: int) -> NDArray[np.bool_]:
    """Which of ``count`` cases have a derived value that its parameter does not allow; ``columns`` has the values."""
    refused = np.zeros(count, dtype=np.bool_)
    for path in study.derive:
        entry = parameter_of(study, path)
        if entry is not None:
            refused |= ~in_range(np.asarray(columns[path], dtype=np.float64), entry)
    return refused


def machines_along(
    study: Study, case: int, paths: tuple[str, ...]
) -> Callable[[NDArray[np.float64]], Mapping[str, ArrayLike]]:
    """The machine of a case for values of some of its parameters, with what is derived from them."""
    own = case_machine(study, case)

    def machines(values: NDArray[np.float64]) -> Mapping[str, ArrayLike]:
        found = dict.fromkeys(paths, values)
        return {**own, **found, **evaluate(study.derive, own, found, len(values))}

    return machines


def allowed_values(study: Study, paths: tuple[str, ...]) -> tuple[float, float]:
    """Smallest and largest value (SI) that all parameters allow."""
    entries = [parameter_of(study, path) for path in paths]
    lows = [entry.low for entry in entries if entry is not None]
    highs = [entry.high for entry in entries if entry is not None]
    return max(lows, default=-np.inf), min(highs, default=np.inf)
