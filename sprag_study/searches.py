"""A search for the best designs whose goals a script computes: the planner of goals, asked and told by hand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from sprag_study.local import run as run_here
from sprag_study.service.client.errors import ArgumentError
from sprag_study.service.client.queries import spec_of
from sprag_study.service.plain_data import plain
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.worker import models
from sprag_study.worker.planning.goals import GoalPlan, GoalPlanner, front
from sprag_study.worker.planning.goals.polish import MET
from sprag_study.worker.planning.goals.record import serve_derivatives
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import NDArray

    from sprag_study.service.client.queries import Spec
    from sprag_study.service.client.synchronous.client import Client
    from sprag_study.service.client.synchronous.study import Study


class Search:
    """A search for the best designs, of which the script tells what they are worth.

    Iterating over it gives the designs of each round, which have to be told in the body of the loop. A pickle has the
    spec and all that was told: the search goes on from there with the same designs, bit for bit.

    Attributes
    ----------
    spec : dict
        The spec of the machine without its goal, which `run` takes with the designs as cases.
    values : tuple of str
        What `tell` needs of each design: the results that goals and limits name.
    """

    def __init__(self, spec: Mapping[str, Any]) -> None:
        self._given = dict(spec)
        self.spec = without_cases(self._given)
        study = parse_spec(self._given, told=_results_in(self._given["goal"])).study
        assert study.plan is not None
        self._plan = GoalPlan.from_json(study.plan)
        self._model, self._infos = study.model, models.results_by_name(study)
        self.values = self._plan.results
        self._paths = [(path, column) for column, paths in enumerate(self._plan.paths) for path in paths]
        self._units = {path: unit_of(study, path) for path, _ in self._paths}
        self._planner = GoalPlanner(self._plan)
        self._step = self._planner.ask()
        self._told: list[Rows] = []
        #: The summaries that these rounds were asked for with.
        self._summaries: list[Mapping[str, Any]] = []

    def __repr__(self) -> str:
        told = sum(len(rows.points) for rows in self._told) // self._plan.cases_each
        return f"Search({', '.join(self.values)}: {told:,} designs told{', ended' if self.done else ''})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _resumed, (self._given, self._told)

    def __iter__(self) -> Iterator[pd.DataFrame]:
        while not self.done:
            rounds = len(self._told)
            yield self.ask()
            if rounds == len(self._told):
                raise ValueError(f"the designs were not told: call `tell` with {', '.join(self.values)} of each")

    @property
    def done(self) -> bool:
        """Whether the search has ended: there is nothing to ask any more."""
        return not len(self._step.points)

    def ask(self) -> pd.DataFrame:
        """The designs of the next round, a row for each, or for each operating point of each. Asking changes nothing.

        The columns are the paths of the parameters, SI; ``attrs["units"]`` has their units. No rows where the search
        has ended.
        """
        return self._framed(self._step.points)

    def run(self, client: Client | None = None, **options: Any) -> Study:
        """The study of the designs that are asked, run to its end; its cases are the rows of `ask`, in that order.

        Parameters
        ----------
        client : Client, optional
            The service that runs them; by default they run in this process, or its pool.
        options
            Those of `sprag.run`, or of `Client.submit`.
        """
        if client is not None:
            return client.submit(self.spec, cases=self.ask(), **options).wait()
        return run_here(self.spec, cases=self.ask(), **options)

    def tell(self, values: Any = None, /, **named: Any) -> None:
        """Tell what the designs of the last `ask` are worth; the next round follows from it.

        Parameters
        ----------
        values : mapping, frame or sequence, optional
            The values of each design, in the order of `ask`, by the names in `values`; further columns do no harm. A
            sequence where there is one name. NaN is a value that a design does not have: without that of a goal it
            counts as failed. In a table of a study of Sprag, also cases without usable results count as failed.
        named
            The same by name, in place of those of ``values``.

        Raises
        ------
        ArgumentError
            Where a value is missing, or there are not as many as designs.
        ValueError
            Where the search has ended.
        """
        if self.done:
            raise ValueError("the search has ended: there are no designs to tell")
        columns = self._columns(values, named)
        names = models.with_half_widths(self.values, columns)
        told = {name: self._numbers(name, columns[name]) for name in names}
        self._take(Rows(self._step.points, self._usable(columns), told))

    def best(self, limit: int | None = None, *, exact: bool = False) -> pd.DataFrame:
        """The designs that were told, the best first: their parameters, their goals, and how they rank.

        ``rank`` is 0 for those that no other one dominates, ``feasible`` whether all limits hold, ``violation`` by how
        much they do not. ``attrs["units"]`` has the units. Rounds that only give derivatives are left out.

        Parameters
        ----------
        limit : int, optional
            Most designs; by default all.
        exact : bool
            Designs must meet equalities to 1e-6 to be feasible, instead of within their bands.
        """
        plan, rows = self._plan, self._ranked_rows()
        ranked = front(plan, rows, equality=MET if exact else None)
        table = self._framed(rows.points[:: plan.cases_each])
        for number, goal in enumerate(plan.best):
            table[goal.name] = ranked.goals[:, number]
            table.attrs["units"][goal.name] = self._unit(goal.name)
        table["feasible"], table["violation"], table["rank"] = ranked.feasible, ranked.violation, ranked.rank
        first = ranked.goals[:, 0] * (-1.0 if plan.best[0].max else 1.0) if plan.best else ranked.violation
        return table.iloc[np.lexsort((np.arange(len(table)), first, ranked.rank))[:limit]]

    def _ranked_rows(self) -> Rows:
        """The rows of all rounds but those which only give derivatives."""
        aside = serve_derivatives(self._summaries)
        rounds = [rows for rows, derivatives in zip(self._told, aside, strict=True) if not derivatives]
        if not rounds:
            nothing = np.empty(0)
            return Rows(self._step.points[:0], nothing.astype(np.bool_), dict.fromkeys(self.values, nothing))
        names = [name for name in rounds[0].values if all(name in rows.values for rows in rounds)]
        return Rows(
            np.concatenate([rows.points for rows in rounds]),
            np.concatenate([rows.ok for rows in rounds]),
            {name: np.concatenate([rows.values[name] for rows in rounds]) for name in names},
        )

    def _framed(self, points: NDArray[np.float64]) -> pd.DataFrame:
        frame = pd.DataFrame({path: points[:, column] for path, column in self._paths})
        frame.attrs["units"] = dict(self._units)
        return frame

    def _unit(self, name: str) -> str:
        return self._infos[name].unit if name in self._infos else "1"

    def _take(self, rows: Rows) -> None:
        self._summaries.append(self._step.summary)
        self._told.append(rows)
        self._planner.tell(rows)
        self._step = self._planner.ask()

    def _columns(self, values: Any, named: dict[str, Any]) -> dict[str, Any]:
        """What was told, by name; ArgumentError where a value is missing, or there are not as many as designs."""
        if values is None:
            given: dict[str, Any] = {}
        elif hasattr(values, "columns"):
            given = {str(name): values[name] for name in values.columns}
        else:
            given = dict(values) if isinstance(values, Mapping) else {self.values[0]: values}
            if len(self.values) > 1 and not isinstance(values, Mapping):
                raise ArgumentError(
                    "values", type(values).__name__, f"a mapping or a frame with {', '.join(self.values)}"
                )
        columns: dict[str, Any] = given | named
        if missing := [name for name in self.values if name not in columns]:
            raise ArgumentError("values", ", ".join(columns), f"a column for {' and '.join(missing)}, too")
        for name in self.values:
            count = np.shape(columns[name])
            if count != (len(self._step.points),):
                raise ArgumentError(
                    f"values[{name!r}]", f"shape {count}", f"{len(self._step.points)} values, one for each row of `ask`"
                )
        return columns

    def _numbers(self, name: str, column: Any) -> NDArray[np.float64]:
        """The values of a column: of a category their codes, NaN for what is missing."""
        info = self._infos.get(name)
        if info is not None and info.kind == "category":
            codes = {category: float(code) for code, category in enumerate(info.categories)}
            return np.array([codes.get(category, np.nan) for category in column])
        try:
            return np.asarray(pd.to_numeric(pd.Series(column)), dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ArgumentError(
                f"values[{name!r}]", type(column).__name__, "a number for each design, NaN for none"
            ) from error

    def _usable(self, columns: Mapping[str, Any]) -> NDArray[np.bool_]:
        """Which rows count: of a table of Sprag those of its usable results, otherwise all."""
        if "ending" not in columns or "flags" not in columns:
            return np.ones(len(self._step.points), dtype=np.bool_)
        return models.usable(self._model, list(columns["ending"]), [_flags_text(cell) for cell in columns["flags"]])


def search(spec: Spec | str | PathLike[str]) -> Search:
    """A search for the best designs whose goals the script computes itself.

    Parameters
    ----------
    spec : mapping, str or path
        As for `sprag.run`, with a goal: ``drive.goal(vary=..., best={"cost": "min"}, subject_to=["mass <= 3"])``. Its
        names are results of the model, with their units, or any others, whose values are plain numbers. Population,
        generations and seed are those of the goal.

    Returns
    -------
    Search

    Raises
    ------
    SpecFileError, SpecError
        For an unreadable file and for an invalid spec.
    ArgumentError
        For a spec without a goal, or with tolerances.
    """
    data, faults = plain(spec_of(spec))
    if faults:
        raise SpecError(faults)
    if not isinstance(data.get("goal"), Mapping):
        raise ArgumentError(
            "spec", data.get("goal"), "a spec with a goal, as `drive.goal(vary=..., best=...)` gives it"
        )
    if data.get("tolerances"):
        raise ArgumentError(
            "spec", "tolerances", "a spec without tolerances: goals of one's own are those of one drive"
        )
    return Search(data)


def _resumed(spec: Mapping[str, Any], told: list[Rows]) -> Search:
    """The search of a pickle."""
    resumed = Search(spec)
    for rows in told:
        resumed._take(rows)
    return resumed


def _flags_text(cell: Any) -> str:
    """The flags of a row joined by commas: of a list, or of a cell of a CSV file, which is NaN where there are none."""
    if isinstance(cell, str):
        return cell.replace(";", ",")
    return ",".join(cell) if isinstance(cell, Iterable) else ""


def _results_in(goal: Mapping[str, Any]) -> list[str]:
    """The names of results in a goal, as far as it can be read."""
    items = [item for part in ("best", "subject_to") for item in goal.get(part) or () if isinstance(item, Mapping)]
    return [item["result"] for item in items if isinstance(item.get("result"), str)]
