"""The machine of a sheet: drawn to scale, with the value at each dimension; of a search its best design.

Each value leads to its field in the form of a variant, which has the same drawing at the same place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from markupsafe import Markup

from sprag_study.sentences import Amount
from sprag_study.service.exports.inputs import inputs
from sprag_study.service.figures.drawing import svg
from sprag_study.service.figures.drawings import drawings
from sprag_study.service.languages import gettext
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import joined
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.headlines.headline import DIMENSION_DIGITS
from sprag_study.service.results.selection import with_tolerance
from sprag_study.service.spec.fields import base_pointer
from sprag_study.worker import models
from sprag_study.worker.models.formulas import evaluate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from sprag_study.service.figures.drawing import Drawing
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

#: Width of the drawing of a mechanism between two columns of values (px), which leaves their text legible.
_WIDTH: Final = 200.0


@dataclass(frozen=True, slots=True)
class Machine:
    """The machine of a sheet: its drawings, and what has no place in them as caption, value and address."""

    drawings: tuple[Markup, ...]
    others: tuple[tuple[str, str, str], ...]


def machine_of(
    study: Study, spec: Mapping[str, Any], reading: Reading, best: Mapping[str, float], variant: str
) -> Machine:
    """A study's machine as elements of a page; ``best`` are the numbers of a design (SI).

    ``variant`` is the address of the form of a variant, as clients see it. Of the numbers without a place in a drawing,
    those are shown that vary or were given.
    """
    best = _whole(study, best) if best else best
    shown = replace(study, base={**study.base, **best})
    label = partial(_label, shown, reading, best=best, ends=_ends(shown))
    every, given = drawings(shown, width=_WIDTH), _given(shown, spec)
    links = _links(given, variant)
    placed = {each.path for drawing in every for each in drawing.dimensions}
    others = [
        (reading.caption(path), label(path), links[path])
        for path, stated in given.items()
        if stated and path not in placed
    ]
    return Machine(tuple(_drawn(every, links, label)), tuple(others))


def drawings_of_case(
    study: Study, spec: Mapping[str, Any], own: Mapping[str, float], reading: Reading, variant: str
) -> list[Markup]:
    """The machine of a case with the numbers that it has for itself (SI), without tolerances: they are drawn."""
    shown = replace(study, base={**study.base, **own})

    def label(path: str) -> str:
        return reading.say(joined("", [Amount(shown.base[path], unit_of(study, path), DIMENSION_DIGITS)]))

    return list(_drawn(drawings(shown, width=_WIDTH), _links(_given(shown, spec), variant), label))


def _given(study: Study, spec: Mapping[str, Any]) -> dict[str, bool]:
    """The numbers of the machine that the form shows, and whether each varies or was given."""
    form = models.model_of(study.model).presentation.form
    return {
        item.path: item.origin != "default"
        for item in inputs(study, spec)
        if item.path in study.base and form.in_sight(item.path)
    }


def _links(paths: Iterable[str], variant: str) -> dict[str, str]:
    return {path: f"{variant}#{base_pointer(path)}" for path in paths}


def _drawn(every: Iterable[Drawing], links: Mapping[str, str], label: Callable[[str], str]) -> Iterator[Markup]:
    """Drawings with their values; a part that is like one before it has only those in which it differs."""
    first: dict[tuple[str, ...], tuple[int, dict[str, str]]] = {}
    for drawing in every:
        labels, like = {each.path: label(each.path) for each in drawing.dimensions}, ""
        part = _part_of(drawing.at)
        if part is not None:
            within = {path.removeprefix(drawing.at): text for path, text in labels.items()}
            before, known = first.setdefault(tuple(within), (part, within))
            if before != part:
                labels = {f"{drawing.at}{name}": text for name, text in within.items() if known[name] != text}
                like = Markup('<p class="soft">{}</p>').format(_like(part + 1, before + 1, same=not labels))
        picture = svg(replace(drawing, about=gettext(drawing.about)), labels, links)
        yield Markup(picture) + like  # noqa: S704 - texts are escaped


def _like(part: int, first: int, *, same: bool) -> str:
    if same:
        return gettext("Part {number}, like part {first}", number=part, first=first)
    return gettext("Part {number}, otherwise like part {first}", number=part, first=first)


def _part_of(at: str) -> int | None:
    """The index of the part of a machine that a drawing shows; None where it shows the whole machine."""
    first, _, rest = at.partition(".")
    return int(rest.partition(".")[0]) if first == "parts" else None


def _whole(study: Study, best: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a design with those tied to them, and those derived from them."""
    tied = [paths for paths in (axis.paths for axis in study.axes) if paths[0] in best]
    known = {path: best[paths[0]] for paths in tied for path in paths if path in study.base}
    derived = evaluate(study.derive, {**study.base, **known}, {}, 1)
    return known | {path: float(column[0]) for path, column in derived.items()}


def _label(
    study: Study, reading: Reading, path: str, *, best: Mapping[str, float], ends: Mapping[str, tuple[float, float]]
) -> str:
    """The value at a dimension: the ends of what varies, the width of a tolerance."""
    si = unit_of(study, path)
    low, high = (best[path],) * 2 if path in best else ends.get(path, (study.base[path],) * 2)
    if low != high:
        both = (number(reading.value(end, si), DIMENSION_DIGITS) for end in (low, high))
        return f"{'…'.join(both)} {unit_text(reading.unit(si))}".strip()
    return reading.say(joined("", [with_tolerance(study, path, Amount(low, si, DIMENSION_DIGITS))]))


def _ends(study: Study) -> dict[str, tuple[float, float]]:
    """The least and the largest value in all cases of each number that varies; of a batch, of its nominal drive."""
    varying = {path: axis.array for axis in study.axes for path in axis.paths}
    if study.derive and study.spread is None:
        varying |= study.columns(range(study.cases))
    return {path: (float(values.min()), float(values.max())) for path, values in varying.items()}
