"""Transients of one case: what is asked for, the document, the table as CSV; a row of results for each of many."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Whole
from sprag_study.service.answers import filled
from sprag_study.service.answers.transients import Transient as TransientData
from sprag_study.service.faults import FaultError, choice_of, parameter_error
from sprag_study.service.figures.transient import transient_figure
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.limits import span
from sprag_study.service.reading.reader import Phrase, joined, term
from sprag_study.service.views.amounts import Range, amount_of
from sprag_study.service.views.case_questions import TRANSIENT, TransientQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.service.views.trajectory import timed_values, trajectory_csv
from sprag_study.worker import models
from sprag_study.worker.limits import MIN_TRAJECTORY_POINTS
from sprag_study.worker.models.abilities import has_motor, has_transients, run_transient, shape_of_transients
from sprag_study.worker.models.transients import KINDS, RESULTS, Course, Transient

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from sprag_study.service.figures.figure import Figure
    from sprag_study.worker.models import KernelShape
    from sprag_study.worker.models.transients import Kind
    from sprag_study.worker.study import Study

#: The parameters of a transient besides its kind.
_RANGES: Final = {
    "load": Range("1", 0.0, 1e6), "torque": Range("N*m", 0.0, 1e12, above=True), "within": Range("1", 0.0, 0.9),
    "revolutions": Range("1", 0.0, 1e5, above=True), "angle": Range("rad", 0.0, math.inf),
}  # fmt: skip
_DEVIATION: Final = 0.01


def course_of(study: Study, case: int, kind: str, given: Mapping[str, str | None]) -> Course:
    """The transient that is asked for.

    Parameters
    ----------
    study : Study
    case : int
    kind : str
        One of ``KINDS``.
    given : mapping
        ``load``, ``angle``, ``torque``, ``within``, ``revolutions``: SI numbers or quantities with a unit, or None.

    Raises
    ------
    FaultError
        About one of the parameters, or because the machine has no transients.
    """
    if not has_transients(study):
        message = f"A machine of model {study.model} has no transients; its motion over time is its trajectory."
        raise FaultError("not-found", message)
    chosen: Kind = choice_of("kind", kind, KINDS)
    motor, end = has_motor(study), models.extent(study, case).end
    found = {name: _value(name, text, end, motor) for name, text in given.items() if text and text.strip()}
    if chosen == "load-step" and "load" not in found:
        allowed = span("0", Amount(1e6, digits=6))
        raise parameter_error("load", "required", "a load step needs the factor on the load after it", None, allowed)
    torque = found.get("torque")
    if torque is not None and (motor or chosen != "run-up"):
        raise parameter_error(
            "torque", "conflict",
            "cannot be given: the motor gives it" if motor else "cannot be given: only a run-up has one",
            given["torque"], "none",
        )  # fmt: skip
    if torque is None and chosen == "run-up" and not motor:
        raise parameter_error(
            "torque", "required", "the run-up of a machine without a motor needs a constant driving torque", None,
            "a torque in N*m above 0",
        )  # fmt: skip
    within = found.get("within", _DEVIATION if motor else 0.0)
    return Course(
        chosen, found.get("load", 1.0), found.get("angle", 0.0), torque, within, found.get("revolutions", 1000.0)
    )


def _value(name: str, text: str, end: float, motor: bool) -> float:
    allowed = _RANGES[name]
    if name == "angle":
        allowed = allowed._replace(high=end)
    if name == "within" and motor:
        allowed = allowed._replace(low=1e-9)
    return amount_of(name, text, allowed)


def row_headings(study: Study) -> list[str]:
    """The names of the values of ``case_rows``."""
    return ["case", *study.columns([0]), "outcome", *(name for name, *_ in RESULTS)]


def case_rows(study: Study, course: Course) -> Iterator[dict[str, str | float | None]]:
    """For each case its number, the values of the axes, the outcome of the transient, and its results, in SI units."""
    for case in range(study.cases):
        made = run_transient(study, case, course, MIN_TRAJECTORY_POINTS)
        yield {"case": case, **study.case_parameters(case), "outcome": made.outcome, **results_json(made)}


def results_json(made: Transient) -> dict[str, float | None]:
    """The results of a transient, SI; None where one does not exist."""
    return {name: value if math.isfinite(value) else None for name, value in made.results.items()}


def completed(course: Course) -> str:
    """The outcome of a transient that comes to its end."""
    return "stopped" if course.kind == "coasting" else "reached"


TransientAnswer = CaseAnswer[tuple[Course, int], Transient]


class TransientView(CaseView[TransientQuestion, tuple[Course, int], Transient]):
    """The run-up from rest of a machine shaft, a step of its load, or its coasting."""

    about = TRANSIENT
    content = "The transient as JSON, its values over time as CSV, or a picture."
    shape = TransientData
    lacks = N_("has no transients")

    def choose(self, study: Study, case: int, question: TransientQuestion) -> tuple[Course, int]:
        """The course of the transient, and the number of its times."""
        given = {name: getattr(question, name) for name in _RANGES}
        return course_of(study, case, question.kind, given), question.points

    def kernels(self, study: Study) -> tuple[KernelShape, ...]:
        """That of transients is compiled apart."""
        return shape_of_transients(study), *super().kernels(study)

    def compute(self, study: Study, case: int, chosen: tuple[Course, int]) -> Transient:
        """Run the transient."""
        return run_transient(study, case, *chosen)

    def json(self, answer: TransientAnswer) -> TransientData:
        """The transient as JSON data."""
        made = answer.result
        values = timed_values(made.motion)
        return filled(
            TransientData,
            answer.chosen[0],
            case=answer.case,
            parameters=answer.study.case_parameters(answer.case),
            outcome=made.outcome,
            cause=made.cause,
            results=results_json(made),
            units={name: unit for name, unit, _ in RESULTS},
            times=values["times"],
            variables=values["variables"],
            values=values["values"],
            ending=made.motion.ending,
        )

    def csv(self, answer: TransientAnswer) -> bytes:
        """Its values over time."""
        return trajectory_csv(answer.result.motion)

    def figure(self, answer: TransientAnswer, columns: int = 2) -> Figure:
        """Speed, torques and energy over time."""
        return transient_figure(answer.result)

    def file_name(self, chosen: tuple[Course, int]) -> str:
        """The name of its kind."""
        return chosen[0].kind

    def has(self, study: Study) -> bool:
        """Whether there are transients."""
        return has_transients(study)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """Coasting first, which every machine can; a torque only where no motor gives it."""
        motor = has_motor(study)
        return {
            "kind": Offered(("coasting",)), "load": Offered(hint="1"), "angle": Offered(hint="0 deg"),
            "torque": Offered(hint="N*m", left_out=motor), "within": Offered(hint=f"{_DEVIATION if motor else 0:g}"),
            "revolutions": Offered(hint="1000"),
        }  # fmt: skip

    def shown(self, answer: TransientAnswer) -> Shown:
        """Its end and its cause, and the results."""
        made = answer.result
        rows = [
            [Phrase(meaning), joined("", [Amount(made.results[name], unit, 6)])]
            for name, unit, meaning in RESULTS
            if math.isfinite(made.results[name])
        ]
        end = joined(" ", (Whole(term(made.outcome)), made.cause))
        return Shown((end,), (ShownTable(_("Results"), (Column(Phrase("Meaning")), Column(Phrase("Value"))), rows),))

    def said(self, answer: TransientAnswer) -> Said:
        """Its end and its cause, and the results."""
        data = {"outcome": answer.result.outcome, "cause": answer.result.cause, "results": results_json(answer.result)}
        return Said(data, answer.result.outcome == completed(answer.chosen[0]))
