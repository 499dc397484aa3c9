"""Bifurcation diagrams and Poincare sections of a case: what is asked for, the document, and the table as CSV."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.answers.sections import Sections
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import choice_of, parameter_error
from sprag_study.service.figures.sections import diagram_figure, section_figure
from sprag_study.service.json_text import numbers
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.units import QuantityError, typed_value
from sprag_study.service.results.start_states import refuse_impossible
from sprag_study.service.views.branch import ENDS_OFFERED, along_offered, named, range_of
from sprag_study.service.views.case_questions import DIAGRAM, SECTION, DiagramQuestion, SectionQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView
from sprag_study.service.views.portrait import Strobed, require_settling, require_strobes
from sprag_study.service.views.setting import Offered
from sprag_study.worker.models.abilities import run_sections
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.sections import CaseSections, Sampling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.figures.figure import Figure
    from sprag_study.worker.study import Study


#: What stands in the empty field of a phase.
_PHASE_OFFERED: Final = Offered(hint="0 deg")


def phase_of(text: str | None) -> float:
    """The phase of the excitation as a part of its period; FaultError about the parameter ``phase``."""
    if text is None or not text.strip():
        return 0.0
    try:
        text = in_language(text)
        angle = typed_value(text, "rad")
    except QuantityError as error:
        raise parameter_error("phase", error.code, error.message, text, "an angle in rad or deg") from error
    if not 0.0 <= angle <= 2.0 * math.pi * (1.0 + 1e-12):
        raise parameter_error("phase", "out-of-range", "outside one period", text, "0 .. 360 deg")
    return min(angle / (2.0 * math.pi), 1.0)


def diagram_of(
    study: Study, case: int, along: str, ends: tuple[str | None, str | None], phase: str | None, size: tuple[int, int]
) -> Sampling:
    """What a diagram asks for.

    Parameters
    ----------
    study : Study
    case : int
    along, ends :
        As `range_of` takes them.
    phase : str, optional
    size : tuple of two int
        Values of the parameter, equally spaced, and strobes of each.

    Raises
    ------
    FaultError
        As `range_of`, and about ``phase``.
    """
    asked = range_of(study, case, along, *ends)
    own = case_machine(study, case)
    corners = [dict.fromkeys(asked.paths, end) for end in (asked.low, asked.high)]
    refuse_impossible(dict.fromkeys(asked.paths, "along"), own, corners)
    return Sampling(asked.paths, np.linspace(asked.low, asked.high, size[0]), phase_of(phase), size[1])


def section_of(study: Study, case: int, phase: str | None, count: int) -> Sampling:
    """What a section asks for; FaultError about ``phase``, or where the machine has no strobes or the case does not
    settle.
    """
    require_strobes(study)
    own = case_machine(study, case)
    require_settling(own)
    path = next(iter(own))
    return Sampling((path,), np.array([own[path]]), phase_of(phase), count)


def variables(study: Study) -> list[str]:
    """Names of the variables of a strobe."""
    pendulums = sorted({path.split(".")[1] for path in case_machine(study, 0) if path.startswith("pendulums.")})
    return ["shaft.speed", *(f"pendulums.{i}.{part}" for i in pendulums for part in ("angle", "speed", "windup"))]


def variable_of(study: Study, name: str | None) -> str:
    """The variable that the picture of a diagram shows, by default the shaft's speed; FaultError about ``y``."""
    return choice_of("y", name, variables(study)) if name and name.strip() else "shaft.speed"


DiagramAnswer = CaseAnswer[tuple[Sampling, str], CaseSections]
SectionAnswer = CaseAnswer[Sampling, CaseSections]


def _json(answer: CaseAnswer[Any, CaseSections], asked: Sampling, along: tuple[str, ...]) -> Sections:
    """The strobes as JSON data, of a diagram ``along`` a parameter."""
    made = answer.result
    return {
        "case": answer.case,
        "parameters": answer.parameters,
        "along": list(along),
        "unit": unit_of(answer.study, along[0]) if along else None,
        "phase": 2.0 * math.pi * asked.phase,
        "parameter": asked.values.tolist() if along else [],
        "regime": [regime or None for regime in made.regimes],
        "order": [order or None for order in made.orders.tolist()],
        "variables": {name: {"unit": unit} for name, unit in zip(made.names, made.units, strict=True)},
        "strobes": {
            name: [numbers(row[~np.isnan(row)]) for row in made.values[:, :, column]]
            for column, name in enumerate(made.names)
        },
    }


def _csv(made: CaseSections, first: dict[str, NDArray[np.float64]]) -> bytes:
    """A row for each strobe: the columns that are ``first``, the regime, the order, the variables."""
    kept = ~np.isnan(made.values[:, :, 0])
    which = np.nonzero(kept)[0]
    columns: dict[str, Any] = {name: values[which].tolist() for name, values in first.items()}
    columns |= {"regime": [made.regimes[row] for row in which.tolist()], "order": made.orders[which].tolist()}
    columns |= {name: made.values[:, :, column][kept].tolist() for column, name in enumerate(made.names)}
    return table_csv(columns, columns.values())


class DiagramView(Strobed, CaseView[DiagramQuestion, tuple[Sampling, str], CaseSections]):
    """A bifurcation diagram: strobes of settled motions along a parameter."""

    about = DIAGRAM
    content = "The strobes as JSON or CSV, or a picture."
    shape = Sections

    def choose(self, study: Study, case: int, question: DiagramQuestion) -> tuple[Sampling, str]:
        """Where the motions are sampled, and the variable of a picture."""
        ends, size = (question.low, question.high), (question.points, question.strobes)
        asked = diagram_of(study, case, question.along, ends, question.phase, size)
        return asked, variable_of(study, question.y)

    def compute(self, study: Study, case: int, chosen: tuple[Sampling, str]) -> CaseSections:
        """Settle the case for each value of the parameter."""
        return run_sections(study, case, chosen[0])

    def json(self, answer: DiagramAnswer) -> Sections:
        """The strobes as JSON data."""
        return _json(answer, answer.chosen[0], answer.chosen[0].paths)

    def csv(self, answer: DiagramAnswer) -> bytes:
        """A row for each strobe."""
        return _csv(answer.result, {answer.chosen[0].paths[0]: answer.chosen[0].values})

    def figure(self, answer: DiagramAnswer, columns: int = 2) -> Figure:
        """One variable at the strobes over the parameter."""
        return diagram_figure(answer.result, answer.study, *answer.chosen)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """The parameters, initial values among them, and the variables of a strobe."""
        y = Offered((variable_of(study, None),), groups=named(variables(study)))
        return {"along": along_offered(study, case, initial=True), **ENDS_OFFERED, "phase": _PHASE_OFFERED, "y": y}


class SectionView(Strobed, CaseView[SectionQuestion, Sampling, CaseSections]):
    """A Poincare section: strobes of the settled motion at a phase of the excitation."""

    about = SECTION
    content = "The strobes as JSON or CSV, or a picture."
    shape = Sections

    def choose(self, study: Study, case: int, question: SectionQuestion) -> Sampling:
        """Where the motion is sampled."""
        return section_of(study, case, question.phase, question.strobes)

    def compute(self, study: Study, case: int, chosen: Sampling) -> CaseSections:
        """Settle the case."""
        return run_sections(study, case, chosen)

    def json(self, answer: SectionAnswer) -> Sections:
        """The strobes as JSON data."""
        return _json(answer, answer.chosen, ())

    def csv(self, answer: SectionAnswer) -> bytes:
        """A row for each strobe."""
        return _csv(answer.result, {})

    def figure(self, answer: SectionAnswer, columns: int = 2) -> Figure:
        """The strobes in the plane of angle and speed of each pendulum."""
        return section_figure(answer.result, answer.study, answer.chosen)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """The phase at which strobes are taken without another."""
        return {"phase": _PHASE_OFFERED}
