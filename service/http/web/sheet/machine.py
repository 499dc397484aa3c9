"""The machine of a sheet: drawn to scale, with the value at each dimension; of a search its best design.

Each value leads to its field in the form of a variant, which has the same drawing at the same place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from sprag.sentences import Amount
from sprag.service.exports.inputs import inputs
from sprag.service.figures.drawing import svg
from sprag.service.figures.drawings import drawings
from sprag.service.languages import gettext
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.reader import joined
from sprag.service.reading.wording import number, unit_text
from sprag.service.results.headlines.headline import DIMENSION_DIGITS
from sprag.service.results.varied import with_tolerance
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.reading.reader import Reading
    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class Machine:
    """The machine of a sheet: its drawings, and what has no place in them as caption, value and address."""

    drawings: tuple[Markup, ...]
    others: tuple[tuple[str, str, str], ...]


def machine_of(
    study: Study, spec: Mapping[str, Any], study_id: str, reading: Reading, best: Mapping[str, float]
) -> Machine:
    """A study's machine as elements of a page; ``best`` are the numbers of a design (SI).

    Of the numbers without a place in a drawing, those are shown that vary or were given.
    """
    shown = replace(study, base={**study.base, **_tied(study, best)}) if best else study
    form = models.model_of(study.model).presentation.form
    seen = {item.path: item.origin != "default" for item in inputs(study, spec)
            if item.path in study.base and form.in_sight(item.path)}  # fmt: skip
    links = {path: f"/new?clone={study_id}#/base/{path.replace('.', '/')}" for path in seen}
    found = []
    for drawing in drawings(shown):
        labels = {each.path: _label(shown, reading, each.path, best) for each in drawing.dimensions}
        drawn = replace(drawing, about=gettext(drawing.about))
        found.append(Markup(svg(drawn, labels, links)))  # noqa: S704 - its texts are escaped
        seen |= dict.fromkeys(labels, False)
    others = [(reading.caption(path), _label(shown, reading, path, best), links[path])
              for path, alone in seen.items() if alone]  # fmt: skip
    return Machine(tuple(found), tuple(others))


def _tied(study: Study, best: Mapping[str, float]) -> dict[str, float]:
    """The numbers of a design with those tied to them."""
    tied = [paths for paths in (axis.paths for axis in study.axes) if paths[0] in best]
    return {path: best[paths[0]] for paths in tied for path in paths if path in study.base}


def _label(study: Study, reading: Reading, path: str, best: Mapping[str, float]) -> str:
    """The value at a dimension: the ends of what varies, the width of a tolerance."""
    si = unit_of(study, path)
    axis = study.axis_of(path)
    chosen = axis is not None and not best.keys().isdisjoint(study.axes[axis].paths)
    if axis is not None and not chosen and len(study.axes[axis]) > 1:
        values = study.axes[axis].array
        low, high = (number(reading.value(float(end), si), DIMENSION_DIGITS) for end in (values.min(), values.max()))
        return f"{low}…{high} {unit_text(reading.unit(si))}".strip()
    value = float(study.axes[axis].array[0]) if axis is not None and not chosen else study.base[path]
    return reading.say(joined("", [with_tolerance(study, path, Amount(value, si, DIMENSION_DIGITS))]))
