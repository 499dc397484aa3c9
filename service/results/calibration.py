"""Calibrations: what is known of the fit of a study."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase
from sprag_study.worker import models
from sprag_study.worker.models import WorkerEnding
from sprag_study.worker.planning.calibrate import CalibratePlan, CalibratePlanner
from sprag_study.worker.planning.calibrate.answer import Answer, answer
from sprag_study.worker.planning.calibrate.lack_of_fit import FarValue, FitTest, far_value, lack_of_fit
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.calibrate.stored import from_json
from sprag_study.worker.planning.rounds import Rows

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.results.curves import Fetch
    from sprag_study.service.storage.studies.records import RoundRecord
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Calibration:
    """A calibration as far as it has come.

    Attributes
    ----------
    study : Study
    plan : CalibratePlan
    infos : dict of ResultInfo
        The measured results by their names.
    answer : Answer or None
        None before the first fit.
    summary : dict
        As of the planner.
    converged : int
        Refits that have converged.
    """

    study: Study
    plan: CalibratePlan
    infos: dict[str, ResultInfo]
    answer: Answer | None
    summary: dict[str, Any]
    converged: int

    @property
    def test(self) -> FitTest | None:
        """The test for lack of fit; None where chi-square says as much, or where points are too few."""
        known = self.answer
        if known is None or self.plan.known_sigma:
            return None
        return lack_of_fit(self.plan, known.residuals, known.sigma, known.leverages)

    @property
    def far(self) -> FarValue | None:
        """The value that is farthest off the others; None where sigma says how far each is."""
        known = self.answer
        if known is None or self.plan.known_sigma:
            return None
        return far_value(self.plan, known.residuals, known.leverages)

    def at(self, condition: NDArray[np.float64]) -> dict[str, float]:
        """A measured condition by the paths of what it varies, SI."""
        return dict(zip(self.plan.paths_at, condition.tolist(), strict=True))

    @property
    def names(self) -> list[str]:
        """Names of what is fitted: the unknown parameters, then gains and offsets of sensors."""
        return [one.paths[0] for one in self.plan.fitted]

    def sensor(self, place: int) -> str:
        """The result whose sensor has the gain or offset at that place of `names`; "" for a parameter."""
        return "" if place < len(self.plan.unknown) else self.names[place].rpartition(".")[0]

    def unit(self, place: int) -> str:
        """The unit of what is at that place of `names`."""
        result, name = self.sensor(place), self.names[place]
        if not result:
            return unit_of(self.study, name)
        return "1" if name.endswith(".gain") else self.infos[result].unit

    def called(self, place: int, *, within: bool = True) -> Name | Phrase:
        """What it is called, within a sentence or at the beginning."""
        result, name = self.sensor(place), self.names[place]
        if not result:
            return Name(name, within=within)
        about = {"name": Name(result, within=True)}
        if name.endswith(".gain"):
            return Phrase("gain of {name}", **about) if within else Phrase("Gain of {name}", **about)
        return Phrase("offset of {name}", **about) if within else Phrase("Offset of {name}", **about)


def plan_of(study: Study) -> CalibratePlan:
    """The calibration of a study; FaultError for a study without one."""
    if study.plan is None or study.kind != CALIBRATE:
        message = N_("the study is not a calibration")
        fault = Fault(None, "conflict", message, allowed="a study whose spec has `calibrate`")
        raise FaultError("invalid-selection", message, [fault])
    return CalibratePlan.from_json(study.plan)


def calibration_of(study: Study, rounds: list[RoundRecord], fetch: Fetch) -> Calibration:
    """What the rows of whole rounds show, or the answer that an ended calibration has stored.

    Raises FaultError for a study that is not a calibration.

    Parameters
    ----------
    rounds : list of RoundRecord
        As `Studies.rounds` gives them.
    fetch : callable
        Gives rows by numbers of cases and names of results.
    """
    plan = plan_of(study)
    infos = {info.name: info for info in models.study_results(study) if info.name in plan.results}
    if rounds and not len(rounds[-1].cases) and "answer" in rounds[-1].summary:
        summary = dict(rounds[-1].summary)
        known, converged = summary.pop("answer"), summary.pop("converged")
        return Calibration(study, plan, infos, None if known is None else from_json(known), summary, converged)
    planner = CalibratePlanner(plan)
    for record in rounds:
        if not len(record.cases):
            break
        cases = np.arange(record.cases.start, record.cases.stop, dtype=np.int64)
        columns = fetch(cases, list(plan.results))
        endings = [ending or WorkerEnding.CANCELLED for ending in columns.endings]
        if WorkerEnding.CANCELLED in endings:
            break
        ok = models.usable(study.model, columns.endings, columns.flags)
        planner.tell(Rows(study.points(record.cases), ok, columns.values))
    refits = planner.state.refits
    converged = 0 if refits is None else int(np.count_nonzero(refits.converged))
    return Calibration(
        study, plan, infos, answer(planner.plan, planner.space, planner.state), planner.summary(), converged
    )
