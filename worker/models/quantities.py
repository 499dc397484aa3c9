"""Quantities: formulas over parameters and results of a case that a study has beside the results of its model.

A quantity is computed from the rows whenever they are read, by `Quantities` alone, and is never stored: rows are those
of the machine, whatever is asked about them. It is a missing value where a result in it is one, where its case has no
row, and where its formula has no finite value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.worker.models.formulas import evaluate, needed, sources
from sprag_study.worker.models.shares import SHARE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

    Floats = NDArray[np.float64]
    Cases = Sequence[int] | range | NDArray[np.integer[Any]]

#: Unit of a quantity that is a share.
PERCENT: Final = "%"


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity of a study.

    Attributes
    ----------
    name : str
        Its name among the results.
    formula : str
        Over paths of parameters, names of results and of other quantities, in SI numbers.
    unit : str
        SI unit of its value; "1" where it has none, `PERCENT` for a share.
    text : str
        The formula as the user wrote it.
    """

    name: str
    formula: str
    unit: str
    text: str

    @property
    def info(self) -> ResultInfo:
        """Its entry among the results."""
        return ResultInfo(self.name, SHARE if self.unit == PERCENT else self.unit, self.text)

    def to_json(self) -> dict[str, str]:
        """All of it but its name, as plain JSON data."""
        return {"formula": self.formula, "unit": self.unit, "text": self.text}

    @classmethod
    def from_json(cls, name: str, data: Mapping[str, Any]) -> Quantity:
        """The quantity that `to_json` wrote; KeyError where it is not one."""
        return cls(name, str(data["formula"]), str(data["unit"]), str(data["text"]))


class Quantities:
    """Some quantities of a study, to be computed from the results of its rows.

    Parameters
    ----------
    study : the study
    results : names of the results of its model that are numbers
    names : those of the quantities

    Raises
    ------
    KeyError
        For a name that is not a quantity of the study.
    """

    def __init__(self, study: Study, results: Iterable[str], names: Iterable[str]) -> None:
        self._study, self.names = study, tuple(dict.fromkeys(names))
        formulas = {one.name: one.formula for one in study.quantities}
        for name in self.names:
            if name not in formulas:
                raise KeyError(name)
        known = {*study.base, *study.column_paths, *(results := frozenset(results)), *formulas}
        self._formulas = needed(formulas, known, self.names)
        self._known = known
        self._from = {name: sources(formulas, known, [name]) & results for name in self.names}
        #: The results of the model that they need.
        self.results: tuple[str, ...] = tuple(sorted(frozenset[str]().union(*self._from.values())))

    def columns(
        self, cases: Cases, results: Mapping[str, Floats], ran: NDArray[np.bool_] | None = None
    ) -> dict[str, Floats]:
        """Their values in some cases, SI: name -> array, shape (m,); NaN for a missing value.

        Parameters
        ----------
        cases : numbers of cases, shape (m,), any order
        results : the results that they need (`results`), each of shape (m,), NaN for a missing value
        ran : which cases have a row, shape (m,); by default all
        """
        base = {**dict.fromkeys(self._known, np.nan), **self._study.base}
        columns = {**self._study.columns(cases), **{name: results[name] for name in self.results}}
        values = evaluate(self._formulas, base, columns, len(cases))
        found = {}
        for name in self.names:
            here = np.isfinite(values[name])
            for own in self._from[name]:
                here &= ~np.isnan(results[own])
            found[name] = np.where(here if ran is None else here & ran, values[name], np.nan)
        return found


def with_quantities(
    study: Study, infos: Sequence[ResultInfo], cases: Cases, values: Floats, ran: NDArray[np.bool_] | None = None
) -> Floats:
    """Rows with the quantities of a study behind the results of its model, in the order of `study_results`.

    Parameters
    ----------
    infos : the results of its model, R
    cases : the case of each row, shape (m,)
    values : float64 array, shape (m, R)
    ran : which rows are those of cases that were run, shape (m,); by default all

    Returns
    -------
    float64 array, shape (m, R + quantities); ``values`` itself where the study has none
    """
    if not study.quantities:
        return values
    numbers = numeric(infos)
    own = Quantities(study, numbers, (one.name for one in study.quantities))
    columns = own.columns(cases, {name: values[:, numbers[name]] for name in own.results}, ran)
    return np.column_stack([values, *(columns[one.name] for one in study.quantities)])


def numeric(infos: Iterable[ResultInfo]) -> dict[str, int]:
    """Places of the results that are numbers, by name: those that a formula may use."""
    return {info.name: place for place, info in enumerate(infos) if info.kind != "category"}
