"""The planner of a calibration: it follows the fit as far as there are rows and asks for the next ones."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.calibrate.answer import answer
from sprag_study.worker.planning.calibrate.batches import total
from sprag_study.worker.planning.calibrate.course import ENDED, Request, State, course
from sprag_study.worker.planning.calibrate.data import first_data
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.calibrate.space import Space
from sprag_study.worker.planning.calibrate.stored import to_json
from sprag_study.worker.planning.rounds import Rows, Step

if TYPE_CHECKING:
    from sprag_study.worker.planning.calibrate.data import Data
    from sprag_study.worker.planning.calibrate.plan import CalibratePlan

Floats = NDArray[np.float64]


class CalibratePlanner:
    """Finds the parameters that explain measured values (`sprag_study.worker.planning.rounds.Planner`).

    Columns of the points are the unknown parameters, then the paths of the conditions. A round is a scan, an iteration
    of the fit, a step of all refits, or the curve.
    """

    def __init__(self, plan: CalibratePlan) -> None:
        self.plan = plan
        self._space = Space(plan.fitted)
        self.state = State(first_data(plan), self._space)
        self._known: dict[bytes, dict[bytes, Floats]] = {}
        self._cases = self._rounds = 0
        self._course = course(plan, self._space, self.state)
        self._request: Request | None = next(self._course)
        self._missing = self._all(self._request)
        self._advance()

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """The parameters of each column of the points."""
        return self.plan.paths

    @property
    def results(self) -> tuple[str, ...]:
        """The measured results."""
        return self.plan.results

    @property
    def most_cases(self) -> int:
        """Cases at most."""
        return self.plan.most_cases

    @property
    def most_rounds(self) -> int:
        """Rounds at most."""
        return self.plan.most_rounds

    def tell(self, rows: Rows) -> None:
        """Take the rows of the next round; they may be of other cases than were asked for.

        Raises
        ------
        ValueError
            If they have other columns.
        """
        p = len(self.plan.unknown)
        if rows.points.shape[1] != p + len(self.plan.paths_at):
            raise ValueError("the cases do not have the columns of this calibration")
        found = np.stack([np.where(rows.ok, rows.values[name], np.nan) for name in self.plan.results], axis=1)
        found[~np.isfinite(found)] = np.nan
        sets, conditions = np.ascontiguousarray(rows.points[:, :p]), np.ascontiguousarray(rows.points[:, p:])
        for one, at, row in zip(sets, conditions, found, strict=True):
            self._known.setdefault(one.tobytes(), {})[at.tobytes()] = row
        self._rounds += 1
        self._cases += len(found)
        self._advance()

    def ask(self) -> Step:
        """The next round, or at the end the answer as `stored.to_json` writes it; asking changes nothing."""
        summary = self.summary()
        if self._request is None:
            found = answer(self.plan, self.space, self.state)
            refits = self.state.refits
            converged = 0 if refits is None else int(np.count_nonzero(refits.converged))
            summary |= {"answer": None if found is None else to_json(found), "converged": converged}
        return Step(self._missing, summary)

    def summary(self) -> dict[str, Any]:
        """What is known now: the phase, the best values so far, chi-square, refits."""
        state, best = self.state, self.state.best
        square, failed = (None, 0) if best is None else _chi_square(state.data, best.modelled)
        return {
            "kind": CALIBRATE,
            "phase": ENDED if self._request is None else state.phase,
            "step": state.round,
            "complete": state.phase == ENDED,
            "unknown": [one.paths[0] for one in self.plan.fitted],
            "values": None if best is None else self._space.values(best.places[0]).tolist(),
            "chi_square": square,
            "freedom": self.plan.freedom - failed,
            "refits": self.plan.refits,
        }

    @property
    def space(self) -> Space:
        """The space of the unknown parameters."""
        return self._space

    def _advance(self) -> None:
        """Go on through the course as far as the known rows allow, or end it where its bounds are reached."""
        while self._request is not None:
            self._missing = self._all(self._request)
            if len(self._missing):
                if self._cases + len(self._missing) > self.most_cases or self._rounds >= self.most_rounds:
                    self._end()
                return
            try:
                self._request = self._course.send(self._rows(self._request))
            except StopIteration:
                self._end()

    def _end(self) -> None:
        self._request = None
        self._missing = np.empty((0, len(self.paths)))

    def _conditions(self, request: Request) -> Floats:
        return self.plan.at if request.others is None else request.others

    def _all(self, request: Request) -> Floats:
        """The cases of a request that are not known, each once."""
        p = len(self.plan.unknown)
        values = np.unique(self._space.values(request.places)[:, :p], axis=0, return_index=True)[1]
        sets = self._space.values(request.places[np.sort(values)])[:, :p]
        conditions = np.ascontiguousarray(self._conditions(request))
        keys = [at.tobytes() for at in conditions]
        parts = []
        for one in sets:
            known = self._known.get(one.tobytes(), {})
            rows = conditions if not known else conditions[[key not in known for key in keys]]
            parts.append(np.hstack([np.tile(one, (len(rows), 1)), rows]))
        return np.concatenate(parts) if parts else np.empty((0, len(self.paths)))

    def _rows(self, request: Request) -> Floats:
        """The known rows of a request, shape (sets, conditions, results)."""
        keys = [at.tobytes() for at in np.ascontiguousarray(self._conditions(request))]
        values = self._space.values(request.places)
        known = [self._known[one.tobytes()] for one in values[:, : len(self.plan.unknown)]]
        return self.plan.readings(np.array([[own[key] for key in keys] for own in known]), values)


def _chi_square(data: Data, modelled: Floats) -> tuple[float, int]:
    """The sum of squares of the residuals, whatever the loss, and how many measured values have no modelled one."""
    failed = np.isnan(modelled[0])
    residuals = np.where(failed, 0.0, data.residuals(modelled)[0])
    return float(total((residuals * residuals)[None, :])[0]), int(failed.sum())
