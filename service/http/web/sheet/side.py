"""What one can ask of a study, its variants, and how far its cases can be trusted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from markupsafe import Markup

from sprag_study.sentences import Name
from sprag_study.service.faults import FaultError
from sprag_study.service.figures.figure import Line
from sprag_study.service.figures.svg import spark
from sprag_study.service.languages import N_, gettext
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.reading.reader import Phrase, joined, term
from sprag_study.service.results.defaults import main_query, varying_axes
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.regimes import DOUBTFUL
from sprag_study.service.views.headline import headline_of, is_small
from sprag_study.service.views.relatives import asked_by, relatives_of
from sprag_study.worker import models
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.storage.studies.records import Kinds, Progress
    from sprag_study.service.views.headline import Headline, Trace
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.relatives import Asked, Relative
    from sprag_study.worker.study import Study

#: Variants that stand beside each other.
_VARIANTS: Final = 5
#: Dimensions of a best design that are told in a line.
_DIMENSIONS: Final = 3
#: The questions after that of the axis, and where a new study begins that asks them.
_QUESTIONS: Final[dict[Asked, tuple[str, str, str]]] = {
    "best": (N_("Which design is best?"), N_("Not searched yet: say what may change"), "/new?clone={id}&asks=goal"),
    "tolerances": (
        N_("What do tolerances do?"),
        N_("No batch yet: say how far drives differ"),
        "/new?clone={id}&batch=on",
    ),
    "measured": (
        N_("Does it match the measurement?"),
        N_("No measured points yet: paste a table"),
        "/studies/{id}/matters?ask=measurement",
    ),
}


@dataclass(frozen=True, slots=True)
class Question:
    """What one can ask, the answer in a line, and where more of it is; ``here``: on this page."""

    text: str
    answer: str
    address: str = ""
    here: bool = False


@dataclass(frozen=True, slots=True)
class Variant:
    """A study of nearly the same machine: what differs, its first number, and a thumbnail."""

    id: str
    title: str
    number: str
    spark: Markup
    here: bool = False


@dataclass(frozen=True, slots=True)
class Trust:
    """How many cases are certified, of how many; the others of each kind, counted, with the address of their list."""

    certified: int
    total: int
    others: tuple[tuple[str, str], ...]

    @property
    def share(self) -> float:
        """The certified part."""
        return self.certified / self.total if self.total else 0.0


@dataclass(frozen=True, slots=True)
class Side:
    """What stands beside and below the answer of a study."""

    questions: list[Question]
    variants: list[Variant]


def side_of(library: Library, study_id: str, headline: Headline, reading: Reading) -> Side:
    """The questions and the variants of a study."""
    study = library.store.studies.study(study_id)
    related = relatives_of(library, study_id)
    return Side(_questions(library, study_id, study, headline, related, reading),
                _variants(library, study_id, study, headline, related, reading))  # fmt: skip


def _questions(
    library: Library,
    study_id: str,
    study: Study,
    headline: Headline,
    related: Sequence[Relative],
    reading: Reading,
) -> list[Question]:
    own = asked_by(study)
    this_page = gettext("This page")
    found = [_along(library, study_id, study, related, reading)]
    for asked, (text, none, address) in _QUESTIONS.items():
        relative = next((one for one in related if one.asked == asked and not one.differs), None)
        if asked == own:
            found.append(Question(gettext(text), this_page, here=True))
        elif relative is not None:
            answer = brief(_headline(library, relative), reading) or relative.record.name
            found.append(Question(gettext(text), answer, f"/studies/{relative.record.id}"))
        else:
            found.append(Question(gettext(text), gettext(none), address.format(id=study_id)))
    case = next((one.case for one in (*headline.dimensions, *headline.numbers) if one.case is not None), None)
    if headline.case is not None or case is not None:
        number = headline.case if headline.case is not None else case
        told = Phrase("Its motion in case {case}", case=number or 0)
        found.append(Question(gettext("How does it move?"), reading.say(told), f"/studies/{study_id}/cases/{number}"))
    return found


def _along(library: Library, study_id: str, study: Study, related: Sequence[Relative], reading: Reading) -> Question:
    """The question of how it runs along an axis."""
    query = None if study.plan is not None and asked_by(study) != "along" else main_query(study)
    if query is None:
        along = models.presentation_of(study).along
        path = along[0] if along else ""
    else:
        path = query.x
    text = gettext("How does it run?")
    if path:
        text = reading.say(Phrase("How does it run along the {name}?", name=Name(path, within=True)))
    if asked_by(study) == "along":
        return Question(text, gettext("This page"), here=True)
    relative = next((one for one in related if path and _answers_along(one, study, path)), None)
    if relative is None:
        return Question(text, gettext("Not run yet: choose the values"), f"/new?clone={study_id}&asks=axes&batch=")
    answer = brief(_headline(library, relative), reading) or relative.record.name
    return Question(text, answer, f"/studies/{relative.record.id}")


def _answers_along(relative: Relative, study: Study, path: str) -> bool:
    """Whether a relative has the curve along an axis of this very machine, and tells about it."""
    other = relative.study
    if relative.asked != "along" or relative.differs:
        return False
    query = main_query(other)
    if query is None or map_plan(other) is not None or other.axis_of(query.x) != other.axis_of(path):
        return False
    # It tells about the curve nearest to its base.
    held = {*other.axis_paths} & study.base.keys() - {*other.axis_with(path).paths, *study.axis_paths, *study.derive}
    return all(math.isclose(other.base[one], study.base[one], rel_tol=SAME_VALUE) for one in held)


def _headline(library: Library, relative: Relative) -> Headline | None:
    """The headline of a relative; None of one whose answer takes long, or has none."""
    if not is_small(relative.study):
        return None
    try:
        return headline_of(library, relative.record.id)
    except FaultError:
        return None


def brief(headline: Headline | None, reading: Reading) -> str:
    """A headline in a line: of a search its value and the first dimensions."""
    if headline is None:
        return ""
    if not headline.limits and not (headline.dimensions and headline.numbers):
        return reading.say(headline.sentence[0]) if headline.sentence else ""
    shown = headline.dimensions[:_DIMENSIONS]
    told = (f"{lower_first(one.title(reading))} {one.said(reading)}" for one in shown)
    value = headline.numbers[0].said(reading) if headline.numbers else ""
    return f"{value}: {', '.join(told)}"


def _variants(
    library: Library,
    study_id: str,
    study: Study,
    headline: Headline,
    related: Sequence[Relative],
    reading: Reading,
) -> list[Variant]:
    """This study, and relatives that ask the same."""
    asked, axes = asked_by(study), {axis.paths for axis in varying_axes(study)}
    own = [
        one
        for one in related
        if one.asked == asked and (one.differs or {axis.paths for axis in varying_axes(one.study)} == axes)
    ]
    found = [Variant(study_id, gettext("This study"), _first(headline, reading), _spark(headline.trace), here=True)]
    for one in own[:_VARIANTS]:
        told = _headline(library, one)
        title = reading.say(one.title) if one.title is not None else one.record.name or one.record.id
        found.append(
            Variant(
                one.record.id,
                f"{title[:1].upper()}{title[1:]}",
                _first(told, reading),
                _spark(None if told is None else told.trace),
            )
        )
    return found


def _first(headline: Headline | None, reading: Reading) -> str:
    """The first key number with its label."""
    if headline is None or not headline.numbers:
        return ""
    first = headline.numbers[0]
    return f"{first.title(reading)} {first.number(reading)} {first.unit_text(reading)}".strip()


def _spark(trace: Trace | None) -> Markup:
    if trace is None:
        return Markup()
    return Markup(spark(Line("", np.array(trace.x), np.array(trace.y), "")))  # noqa: S704 - numbers only


def trust_of(study_id: str, progress: Progress, kinds: Kinds) -> Trust:
    """How many of the finished cases show a settled, stable motion; of models without regimes, have a result."""
    failed = {name: count for name, count in progress.endings.items() if name != models.OK}
    doubtful = {name: count for name, count in kinds.regimes.items() if name in DOUBTFUL}
    doubtful |= {name: count for name, count in kinds.flags.items() if name == models.NOT_SETTLED and not kinds.regimes}
    others = {**doubtful, **failed}
    certified = progress.ok - sum(doubtful.values())
    keys = {name: "ending" if name in failed else "regime" if kinds.regimes else "flag" for name in others}
    listed = tuple(
        (joined(" ", (count, term(name))), f"/studies/{study_id}/rows?{keys[name]}={name}")
        for name, count in others.items()
    )
    return Trust(certified, progress.done, listed)
