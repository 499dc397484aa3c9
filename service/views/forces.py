"""The forces of one case: what is asked for, the document, and its tables as CSV."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount
from sprag_study.service.answers import filled
from sprag_study.service.answers.forces import Forces as ForcesData
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import FaultError, choice_of
from sprag_study.service.figures.forces import body_label, forces_figure
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.regimes import without_orbit
from sprag_study.service.views.amounts import Range, amount_of
from sprag_study.service.views.case_questions import FORCES, ForcesQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.portrait import require_settled
from sprag_study.service.views.setting import Offered, choices_of
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.service.views.trajectory import timed_values, trajectory_csv
from sprag_study.worker import models
from sprag_study.worker.models.abilities import bearing_of, has_reactions, run_forces
from sprag_study.worker.models.forces import Bearing, Forces

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.views.shown import Cell
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: Exponents of the life by the kind of a bearing (ISO 281).
_EXPONENTS: Final = {"ball": 3.0, "roller": 10.0 / 3.0}
_RANGES: Final = {
    "shaft_mass": Range("kg", 0.0, 1e6), "load_rating": Range("N", 0.0, 1e12, above=True),
    "share": Range("1", 0.0, 1.0, above=True),
}  # fmt: skip
_DIRECTIONS: Final = (
    ("force_x", Phrase("to the right")),
    ("force_y", Phrase("upward")),
    ("force", Phrase("magnitude")),
)
_VIBRATIONS: Final = (("power_x", Phrase("horizontal")), ("power_y", Phrase("vertical")))
_STATISTICS: Final = {
    "mean": Phrase("Mean"), "min": Phrase("Smallest"), "max": Phrase("Largest"), "rms": Phrase("Root mean square"),
}  # fmt: skip
#: Ranges of a spring, with their headings and units.
_SPRING: Final = {
    "force.min": (Phrase("Smallest force"), "N"), "force.max": (Phrase("Largest force"), "N"),
    "moment.min": (Phrase("Smallest moment"), "N*m"), "moment.max": (Phrase("Largest moment"), "N*m"),
}  # fmt: skip

ForcesAnswer = CaseAnswer[tuple[Bearing, int, str], Forces]


class ForcesView(CaseView[ForcesQuestion, tuple[Bearing, int, str], Forces]):
    """The forces of a case on the table and on the bearings of its shaft."""

    about = FORCES
    content = "The results and the forces over time as JSON, one of both as CSV, or a picture."
    shape = ForcesData
    lacks = N_("has no vibrating table, so that no forces act on one")

    def choose(self, study: Study, case: int, question: ForcesQuestion) -> tuple[Bearing, int, str]:
        """What is known of the bearing, from the question or else from the machine, the number of times, and the table
        of a CSV file.
        """
        if not self.has(study):
            message = f"A machine of model {study.model} has no vibrating table, so that no forces act on one."
            raise FaultError("not-found", message)
        require_settled(study, case)
        texts = {name: getattr(question, name) for name in _RANGES}
        given = {name: amount_of(name, text, _RANGES[name]) for name, text in texts.items() if text and text.strip()}
        kind = question.bearing and choice_of("bearing", question.bearing, _EXPONENTS)
        machine = bearing_of(study, case)
        bearing = Bearing(
            given.get("load_rating", machine.rating), _EXPONENTS[kind] if kind else machine.exponent,
            given.get("share", machine.share), given.get("shaft_mass", machine.shaft_mass),
        )  # fmt: skip
        return bearing, question.points, choice_of("table", question.table, choices_of(ForcesQuestion, "table"))

    def compute(self, study: Study, case: int, chosen: tuple[Bearing, int, str]) -> Forces:
        """Run the case."""
        return run_forces(study, case, *chosen[:2])

    def json(self, answer: ForcesAnswer) -> ForcesData:
        """The results and the forces over time as JSON data."""
        made, bearing, values = answer.result, answer.chosen[0], timed_values(answer.result.motion)
        return filled(
            ForcesData,
            made,
            case=answer.case,
            parameters=answer.parameters,
            regime=made.regime or None,
            shaft_mass=bearing.shaft_mass,
            load_rating=bearing.rating if math.isfinite(bearing.rating) else None,
            exponent=bearing.exponent,
            share=bearing.share,
            results={name: _number(value) for name, value in made.results.items()},
            units={info.name: info.unit for info in made.infos},
            meanings={info.name: info.description for info in made.infos},
            times=values["times"],
            variables=values["variables"],
            values=values["values"],
        )

    def csv(self, answer: ForcesAnswer) -> bytes:
        """A row for each result, or for each time."""
        made = answer.result
        if answer.chosen[2] == "forces":
            return trajectory_csv(made.motion)
        columns: dict[str, list[Any]] = {
            "result": [info.name for info in made.infos],
            "value": [made.results[info.name] for info in made.infos],
            "unit": [info.unit for info in made.infos],
            "meaning": [info.description for info in made.infos],
        }
        return table_csv(columns, columns.values())

    def file_name(self, chosen: tuple[Bearing, int, str]) -> str:
        """The name of the view, also for its other table."""
        return "forces" if chosen[2] == "results" else "forces-over-time"

    def figure(self, answer: ForcesAnswer, columns: int = 2) -> Figure:
        """The forces over time."""
        return forces_figure(answer.result, Phrase(models.ENDING_SENTENCES[answer.result.ending]))

    def has(self, study: Study) -> bool:
        """Whether there is a vibrating table."""
        return has_reactions(study)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """What is asked without other settings."""
        bearing = bearing_of(study, case)
        rating = f"{bearing.rating:.6g} N" if math.isfinite(bearing.rating) else "N"
        return {
            "shaft_mass": Offered(hint=f"{bearing.shaft_mass:.6g} kg"), "load_rating": Offered(hint=rating),
            "share": Offered(hint=f"{bearing.share:.6g}"),
        }  # fmt: skip

    def shown(self, answer: ForcesAnswer) -> Shown:
        """The largest force and the life, and tables of the results; or why the case did not end ok.

        Where the motion has no orbit, that comes first.
        """
        made = answer.result
        if made.ending != models.OK:
            return Shown((Phrase(models.ENDING_SENTENCES[made.ending]),))
        return Shown([*without_orbit(made.regime, answer.study.model), *_sentences(made)], _tables(made))

    def said(self, answer: ForcesAnswer) -> Said:
        """The results, or how the case ended."""
        results = {name: _number(value) for name, value in answer.result.results.items()}
        return Said({"ending": answer.result.ending, "results": results}, answer.result.ending == models.OK)


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _sentences(made: Forces) -> list[str]:
    found = made.results
    said: list[str] = [
        Phrase(
            "The largest force on the table is {force}. The vibration gives {power} on average.",
            force=Amount(found["table.force.max"], "N"),
            power=Amount(found["excitation.power_x.mean"] + found["excitation.power_y.mean"], "W"),
        )
    ]
    life, load = found["bearing.rating_life.time"], found["bearing.equivalent_load"]
    if math.isfinite(life):
        said.append(
            Phrase(
                "The basic rating life of the bearing is {hours} h under the dynamic equivalent load {load}.",
                hours=Amount(life / 3600.0, digits=4),
                load=Amount(load, "N"),
            )
        )
    elif not math.isfinite(load):
        said.append(Phrase("The shaft does not turn, so that its bearings have no rating life."))
    return said


def _tables(made: Forces) -> tuple[ShownTable, ...]:
    """What acts on the table, what the vibrations give, the springs, and the bearing."""
    found = made.results
    bodies = [name.removesuffix(".force.max") for name in found if name.endswith(".force.max") and "spring" not in name]
    on_table: list[list[Cell]] = [
        [body_label(body), way, *(found.get(f"{body}.{direction}.{name}") for name in _STATISTICS)]
        for body in bodies
        for direction, way in _DIRECTIONS
    ]
    powers: list[list[Cell]] = [
        [way, *(found[f"excitation.{power}.{name}"] for name in ("mean", "max"))] for power, way in _VIBRATIONS
    ]
    springs: list[list[Cell]] = [
        [body_label(body), *(found[f"{body}.spring.{name}"] for name in _SPRING)] for body in bodies[1:]
    ]
    named = [info for info in made.infos if info.name.startswith("bearing.") and info.unit != "s"]
    return (
        ShownTable(
            _("Forces on the table"),
            (
                Column(Phrase("Part")),
                Column(Phrase("Direction")),
                *(Column(text, "N") for text in _STATISTICS.values()),
            ),
            on_table,
        ),
        ShownTable(
            _("Power of the vibration"),
            (Column(Phrase("Vibration")), Column(Phrase("Mean"), "W"), Column(Phrase("Largest"), "W")),
            powers,
        ),
        ShownTable(
            _("Springs"), (Column(Phrase("Part")), *(Column(text, unit) for text, unit in _SPRING.values())), springs
        ),
        ShownTable(
            _("Bearing of the shaft"),
            (Column(Phrase("Meaning")), Column(Phrase("Value"))),
            [_named(info, found[info.name]) for info in named if math.isfinite(found[info.name])],
        ),
    )


def _named(info: ResultInfo, value: float) -> list[Cell]:
    return [Phrase(info.description), joined("", [Amount(value, info.unit, 6)])]
