"""The start-up of one case: what is asked for, the document, and its motion as CSV."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount
from sprag_study.service.answers import filled
from sprag_study.service.answers.start_ups import StartUp as StartUpData
from sprag_study.service.faults import FaultError
from sprag_study.service.figures.start_up import start_up_figure
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.regimes import without_orbit
from sprag_study.service.views.amounts import Range, amount_of, time_of
from sprag_study.service.views.case_questions import START_UP, StartUpQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.service.views.trajectory import timed_values, trajectory_csv
from sprag_study.worker import models
from sprag_study.worker.models.abilities import has_start_ups, run_start_up, shape_of_start_ups
from sprag_study.worker.models.ramps import MOST_PERIODS, Ramps, StartUp

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.worker.models import KernelShape, ResultInfo
    from sprag_study.worker.study import Study

#: Largest share by which a mean speed may differ from the settled one.
_WITHIN: Final = Range("1", 0.0, 0.5, above=True)
#: Results that are in no table: those of the sentences, and what checks the computation.
_UNLISTED: Final = frozenset({"time", "duration", "balance.energy"})
#: Those of a single clutch, which are the same as of all.
_OF_ONE: Final = frozenset({"pendulums.0.torque.max", "pendulums.0.engagements"})

StartUpAnswer = CaseAnswer[tuple[Ramps, int], StartUp]


class StartUpView(CaseView[StartUpQuestion, tuple[Ramps, int], StartUp]):
    """The start-up of a case until its shaft runs at its settled speed."""

    about = START_UP
    content = "The results and the motion over time as JSON, the motion as CSV, or a picture."
    shape = StartUpData
    lacks = N_("has no excitation whose frequency could rise")

    def choose(self, study: Study, case: int, question: StartUpQuestion) -> tuple[Ramps, int]:
        """The ramps, and the number of times."""
        if not self.has(study):
            message = f"A machine of model {study.model} has no excitation whose frequency could rise."
            raise FaultError("not-found", message)
        period = models.extent(study, case).period
        times = Range("s", 0.0, MOST_PERIODS * period)
        ranges = {
            "start_frequency": Range("Hz", 0.0, 1.0 / period), "within": _WITHIN,
        }  # fmt: skip
        given = {name: text for name in (*ranges, "ramp", "load_ramp") if (text := _given(question, name))}
        values = {name: amount_of(name, given[name], ranges[name]) for name in ranges if name in given}
        values |= {
            field: time_of(name, given[name], times, period)
            for field, name in (("frequency_time", "ramp"), ("load_time", "load_ramp"))
            if name in given
        }
        return Ramps(**values), question.points

    def kernels(self, study: Study) -> tuple[KernelShape, ...]:
        """That of ramps is compiled apart."""
        return shape_of_start_ups(study), *super().kernels(study)

    def compute(self, study: Study, case: int, chosen: tuple[Ramps, int]) -> StartUp:
        """Run the start-up."""
        return run_start_up(study, case, *chosen)

    def json(self, answer: StartUpAnswer) -> StartUpData:
        """The results and the motion over time as JSON data."""
        made, ramps, values = answer.result, answer.chosen[0], timed_values(answer.result.motion)
        return filled(
            StartUpData,
            made,
            case=answer.case,
            parameters=answer.parameters,
            ramp=ramps.frequency_time,
            start_frequency=ramps.start_frequency,
            load_ramp=ramps.load_time,
            within=ramps.within,
            regime=made.regime or None,
            results=_results(made),
            units={info.name: info.unit for info in made.infos},
            meanings={info.name: info.description for info in made.infos},
            times=values["times"],
            variables=values["variables"],
            values=values["values"],
            states=values["states"],
        )

    def csv(self, answer: StartUpAnswer) -> bytes:
        """The motion over time."""
        return trajectory_csv(answer.result.motion)

    def figure(self, answer: StartUpAnswer, columns: int = 2) -> Figure:
        """What is ramped, the speed, the angles and the torques over time."""
        return start_up_figure(answer.result, Phrase(models.ENDING_SENTENCES[answer.result.ending]))

    def has(self, study: Study) -> bool:
        """Whether there is an excitation."""
        return has_start_ups(study)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """What is asked without other settings."""
        return {
            "ramp": Offered(hint="0 s"), "start_frequency": Offered(hint="0 Hz"), "load_ramp": Offered(hint="0 s"),
            "within": Offered(hint=f"{Ramps().within:g}"),
        }  # fmt: skip

    def shown(self, answer: StartUpAnswer) -> Shown:
        """How long it takes, and a table of the results; or why the case did not end ok."""
        made = answer.result
        if made.ending != models.OK:
            return Shown((Phrase(models.ENDING_SENTENCES[made.ending]),))
        rows = [
            [_meaning(made, info), joined("", [Amount(value, info.unit, 6)])]
            for info in made.infos
            if info.name not in _unlisted(made) and math.isfinite(value := made.results[info.name])
        ]
        table = ShownTable(_("Start-up"), (Column(Phrase("Meaning")), Column(Phrase("Value"))), rows)
        return Shown([*_sentences(made, answer.chosen[0]), *without_orbit(made.regime, answer.study.model)], (table,))

    def said(self, answer: StartUpAnswer) -> Said:
        """The results, or how the case ended."""
        made = answer.result
        data = {"ending": made.ending, "reached": made.reached, "results": _results(made)}
        return Said(data, made.ending == models.OK)


def _meaning(made: StartUp, info: ResultInfo) -> Phrase:
    """What a result means, with its pendulum where there are several."""
    first, _dot, rest = info.name.partition(".")
    if first != "pendulums" or "pendulums.1.torque.max" not in made.results:
        return Phrase(info.description)
    number = Phrase("Pendulum {number}", number=int(rest.partition(".")[0]) + 1)
    return joined(": ", [number, Phrase(info.description)])


def _given(question: StartUpQuestion, name: str) -> str:
    return (getattr(question, name) or "").strip()


def _unlisted(made: StartUp) -> frozenset[str]:
    alone = "pendulums.1.torque.max" not in made.results
    nothing = {"energy.reset"} if made.results["energy.reset"] == 0.0 else set()
    return _UNLISTED | nothing | (_OF_ONE if alone else frozenset())


def _results(made: StartUp) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in made.results.items()}


def _sentences(made: StartUp, ramps: Ramps) -> list[str]:
    found = made.results
    if not found["speed.settled"] > 0.0:
        return [Phrase("The drive comes to a motion in which the shaft stands.")]
    speed = Amount(found["speed.settled"], "rad/s")
    if not made.reached:
        return [
            Phrase(
                "After {duration} the mean speed of the shaft does not yet stay within {share} of the settled speed "
                "{speed}; the numbers are those of this time.",
                duration=Amount(found["duration"], "s"),
                share=Amount(100.0 * ramps.within, "%"),
                speed=speed,
            )
        ]
    return [
        Phrase(
            "After {time} the shaft runs at its settled speed {speed}.", time=Amount(found["time"], "s"), speed=speed
        ),
        Phrase(
            "Until then the exciter gives {input} to the pendulums, of which {useful} go to the load.",
            input=Amount(found["energy.input"], "J"),
            useful=Amount(found["energy.useful"], "J"),
        ),
    ]
