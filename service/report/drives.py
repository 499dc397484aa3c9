"""The parts of a report about a batch of drives and about a calibration: a figure, and what should be known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount
from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.calibration import calibration_figure
from sprag_study.service.figures.ribbons import ribbon_figure
from sprag_study.service.languages import _
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.calibration_words import sentences
from sprag_study.service.results.defaults import drawn_results
from sprag_study.service.results.headlines.along import judged_by
from sprag_study.service.results.tolerances.batch import Asked
from sprag_study.service.results.tolerances.conditions import first_condition
from sprag_study.service.results.tolerances.ribbons import QUANTILES, ribbon
from sprag_study.service.results.tolerances.written import at_line, causes_sentences, worst_sentences, yield_sentence
from sprag_study.service.results.tolerances.yields import yields

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.results.calibration import Calibration
    from sprag_study.service.results.curves import Fetch
    from sprag_study.worker.study import Study

#: Drives in the list of the worst ones.
_WORST: Final = 5


@dataclass(frozen=True, slots=True)
class DrivesPart:
    """A figure with its caption, None where there is none, and sentences."""

    figure: Figure | None
    caption: str
    sentences: tuple[str, ...]


def drives_part(study: Study, fetch: Fetch) -> DrivesPart | None:
    """The part about the drives; None for a study without tolerances, or one that chooses its own cases."""
    if not study.batched:
        return None
    names = drawn_results(study)
    try:
        drawn = ribbon(study, names, Asked(), QUANTILES, fetch)
        wanted = first_condition(study, judged_by(study, names))
        reached = yields(study, [wanted], Asked(), _WORST, fetch)
    except SelectionError as error:
        return DrivesPart(None, "", (Phrase("There are no ribbons here: {why}.", why=str(error)),))
    sentences: list[str] = [plural("{count} drive was drawn.", "{count} drives were drawn.", study.drives)]
    for one, line in zip(drawn.lines, reached.lines, strict=True):
        at = at_line(drawn.places, line.line)
        parts = [yield_sentence(line, reached.conditions[0].text), *worst_sentences(line)]
        parts += [text for name in names for text in causes_sentences(study, one.spreads[name].causes, name)]
        sentences += [joined(": ", (at, text)) if at else text for text in parts]
    return DrivesPart(ribbon_figure(drawn), _("Quantiles over the drives"), tuple(sentences))


def calibration_part(found: Calibration) -> DrivesPart:
    """The part about the calibration."""
    if found.answer is None:
        return DrivesPart(None, "", (Phrase("The first fit has not ended yet."),))
    caption = _("Measured points on the fitted curve, and residuals")
    return DrivesPart(calibration_figure(found), caption, (*_values(found), *sentences(found)))


def _values(found: Calibration) -> Iterator[str]:
    known = found.answer
    assert known is not None
    for index in range(len(found.names)):
        unit = found.unit(index)
        value = Phrase(
            "{name} = {value}", name=found.called(index, within=False), value=Amount(known.values[index], unit, 6)
        )
        if known.intervals is None:
            yield joined("", (value, "."))
            continue
        low, high = (Amount(end, unit, 6, bare=True) for end in known.intervals[index])
        yield Phrase("{value} (95 % interval {low} to {high}).", value=value, low=low, high=high)
