"""A sweep once more, with smaller steps where the motion jumps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.spec.axes.axes import SWEPT
from sprag_study.service.spec.component_axes import axis_item
from sprag_study.service.spec.fields import renamed
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.kinds.sweep import sweep_of
from sprag_study.worker.directions import DIRECTIONS, DOWN
from sprag_study.worker.limits import NARROW_STEPS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

_SUFFIX: Final = ", narrowed"


def swept_axis(study: Study) -> int:
    """Position of the swept axis of a swept study."""
    position = None if study.sweep is None else study.axis_of(study.sweep)
    assert position is not None
    return position


def jumped_over(study: Study, cases: NDArray[np.int64]) -> NDArray[np.float64]:
    """The steps of the swept axis before these cases: from the lower to the upper value, shape (steps, 2), each once.

    Parameters
    ----------
    study : a swept grid
    cases : numbers of cases that are not the first of their lines
    """
    swept = swept_axis(study)
    values = np.sort(study.axes[swept].array)
    indices = study.indices(cases)
    back = np.where(study.axes[-1].array[indices[-1]] == DOWN, 1, -1)
    at = np.searchsorted(values, study.axes[swept].array[indices[swept]])
    low = np.unique(np.minimum(at, at + back))
    return np.column_stack([values[low], values[low + 1]])


def narrowed_values(values: NDArray[np.float64], jumps: NDArray[np.float64], steps: int) -> NDArray[np.float64]:
    """The values of an axis, ascending, with each of the steps ``jumps`` split into so many."""
    low, high = jumps[:, :1], jumps[:, 1:]
    inside = low + (high - low) * (np.arange(1, steps) / steps)
    return np.unique(np.concatenate([values, inside.reshape(-1)]))


def narrowed_cases(study: Study, cases: NDArray[np.int64], steps: int = NARROW_STEPS) -> int:
    """Cases of the study of `narrowed_spec` with all values of the other axes."""
    length = len(study.axes[swept_axis(study)])
    return study.cases // length * (length + len(jumped_over(study, cases)) * (steps - 1))


def narrowed_spec(
    spec: Mapping[str, Any], study: Study, cases: NDArray[np.int64], steps: int, fixed: Mapping[int, int]
) -> dict[str, Any]:
    """The spec of a sweep with smaller steps where the motion jumps.

    Parameters
    ----------
    spec : the study's own spec
    study : the same in SI numbers, a swept grid
    cases : numbers of the cases whose motion jumps, at least one
    steps : into how many the steps before these cases are split
    fixed : axes of which only one value is swept again, with its position
    """
    jumps, swept, last = jumped_over(study, cases), swept_axis(study), len(study.axes) - 1
    axes = []
    for position, axis in enumerate(study.axes[:-1]):
        values = axis.array
        if position in fixed:
            values = axis.array[fixed[position] : fixed[position] + 1]
        elif position == swept:
            values = narrowed_values(axis.array, jumps, steps)
        axes.append(axis_item(spec, study, axis, values.tolist()))
    one = {SWEPT.name: DIRECTIONS[int(study.axes[last].value(fixed[last]))]} if last in fixed else sweep_of(study)
    axes[swept] |= one
    return {**without_cases(spec), "name": renamed(study.name, _SUFFIX), "combine": "grid", "axes": axes}
