"""How one case approaches its motion, strobe by strobe, and its orbit: the document, and its tables as CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.answers.results import Portrait as PortraitData
from sprag_study.service.faults import FaultError, choice_of, parameter_error
from sprag_study.service.figures.portrait import portrait_figure
from sprag_study.service.languages import N_
from sprag_study.service.results.regimes import motion_sentence
from sprag_study.service.views.case_questions import STROBES, StrobesQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView
from sprag_study.service.views.setting import choices_of
from sprag_study.service.views.shown import Shown
from sprag_study.service.views.trajectory import timed_values, trajectory_csv
from sprag_study.worker import models
from sprag_study.worker.models import Portrait
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.vibration_drive.settled import CYCLIC_LOAD, swings

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.figures.figure import Figure
    from sprag_study.worker.study import Study


def require_strobes(study: Study) -> None:
    """Raise FaultError where the study's machine has no strobes."""
    if not models.has_strobes(study):
        message = f"A machine of model {study.model} has no excitation, so it has no strobes."
        raise FaultError("not-found", message)


#: Why a case has no motion to which it settles.
SWINGS: Final = Sentence(
    "has a load that swings with the angle of the shaft ({path}), so that its motion does not repeat with the "
    "vibration",
    path=CYCLIC_LOAD,
)


def require_settling(values: Mapping[str, Any], along: tuple[str, ...] = ()) -> None:
    """Raise FaultError where no motion is looked for to which a case settles.

    Parameters
    ----------
    values : mapping
        Parameters of the case.
    along : tuple of str
        Paths of the parameters along which the case is followed.
    """
    if swings(values):
        raise parameter_error("case", "conflict", SWINGS)
    if CYCLIC_LOAD in along:
        raise parameter_error("along", "conflict", SWINGS, CYCLIC_LOAD)


def require_settled(study: Study, case: int) -> None:
    """Raise FaultError where a study asks for the settled motion of a case and none is looked for.

    Such a case is a drive that an earlier release has drawn.
    """
    if models.is_settled(study.run):
        require_settling(case_machine(study, case))


class Strobed:
    """A view of cases whose motion is looked at once in each period: which studies have it."""

    lacks = N_("has no motion that settles")

    def has(self, study: Study) -> bool:
        """Whether there are strobes."""
        return models.has_strobes(study)


StrobesAnswer = CaseAnswer[str, Portrait]


class StrobesView(Strobed, CaseView[StrobesQuestion, str, Portrait]):
    """How a case approaches its motion, once per excitation period, and its orbit."""

    about = STROBES
    content = "Strobes and orbit as JSON, one of them as CSV, or a picture."
    shape = PortraitData

    def choose(self, study: Study, case: int, question: StrobesQuestion) -> str:
        """The table of a CSV file."""
        require_strobes(study)
        require_settled(study, case)
        return choice_of("table", question.table, choices_of(StrobesQuestion, "table"))

    def compute(self, study: Study, case: int, chosen: str) -> Portrait:
        """Run the case."""
        return models.run_portrait(study, case)

    def json(self, answer: StrobesAnswer) -> PortraitData:
        """Strobes and orbit as JSON data."""
        made = answer.result
        return {
            "case": answer.case,
            "parameters": answer.parameters,
            "regime": made.regime or None,
            "order": made.order or None,
            "strobes": timed_values(made.strobes),
            "orbit": timed_values(made.orbit) if made.orbit.times.size else None,
            "ending": made.ending,
        }

    def csv(self, answer: StrobesAnswer) -> bytes:
        """One of the tables."""
        return trajectory_csv(answer.result.strobes if answer.chosen == "strobes" else answer.result.orbit)

    def figure(self, answer: StrobesAnswer, columns: int = 2) -> Figure:
        """Orbit and strobes, beside the strobes period by period."""
        return portrait_figure(answer.result, models.presentation_of(answer.study), columns)

    def shown(self, answer: StrobesAnswer) -> Shown:
        """The settled motion in a sentence."""
        made = answer.result
        return Shown((motion_sentence(made.regime, made.order or None),) if made.regime else ())

    def file_name(self, chosen: str) -> str:
        """The name of the table."""
        return chosen
