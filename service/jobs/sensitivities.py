"""What the results of a study depend on, as bytes that are ready to be sent, as for `sprag.service.jobs.answers`."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.results import exports
from sprag.service.results.pictures.sensitivity import draw_sensitivity
from sprag.service.results.sensitivity import Sensitivity, sensitivity
from sprag.service.results.sensitivity_indices import Indices

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag.service.answers.results import ResultSensitivity
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice, Reading
    from sprag.service.results.pictures.curves import Picture


def sensitivities_of(library: Library, study_id: str, names: Sequence[str]) -> list[Sensitivity]:
    """The sensitivities of these results; raises SelectionError and StudyNotFoundError."""
    store = library.store
    fetch = partial(store.rows_for_cases, study_id)
    return sensitivity(store.study(study_id), store.spec(study_id), list(names), fetch)


def sensitivities_shown(library: Library, study_id: str, names: Sequence[str]) -> list[ResultSensitivity]:
    """The same as JSON data."""
    return [item.to_json() for item in sensitivities_of(library, study_id, names)]


def sensitivities_as_json(
    library: Library, study_id: str, names: Sequence[str], warnings: Mapping[str, object]
) -> bytes:
    """The same as JSON text, with the warnings of the answer."""
    return to_bytes({"study": study_id, "results": sensitivities_shown(library, study_id, names), **warnings})


def sensitivities_picture(
    library: Library, study_id: str, names: Sequence[str], choice: Choice, title: str, form: Picture
) -> bytes:
    """The same as a picture."""
    found = sensitivities_of(library, study_id, names)
    return draw_sensitivity(found, title, reading_of(library.store, study_id, choice), form)


def sensitivities_as_csv(library: Library, study_id: str, names: Sequence[str], choice: Choice) -> bytes:
    """The same as a table; `indices_csv` tells its rows."""
    return indices_csv(sensitivities_of(library, study_id, names), reading_of(library.store, study_id, choice))


#: Indices in the unit of the result; the others are shares of its variance.
_IN_ITS_UNIT: Final = ("mu", "mu_star", "mu_star_error", "sigma")


def indices_csv(found: Sequence[Sensitivity], reading: Reading) -> bytes:
    """A row for each result and axis: the indices with the half widths of their intervals; then one for each pair.

    Elementary effects are in the reader's unit of their result, which ``unit`` names.
    """
    indices = [field.name for field in fields(Indices)]
    header = ["result", "paths", *indices, "other_paths", "second_order", "second_order_error"]
    header += ["unit", "method", "cases", "notes"]
    rows = []
    for item in found:
        unit = item.info.unit
        about = [reading.unit(unit), item.method, item.cases, "; ".join(item.notes)]
        names = [" ".join(effect.paths) for effect in item.effects]
        for name, effect in zip(names, item.effects, strict=True):
            own = [
                reading.value(getattr(effect.indices, index), unit if index in _IN_ITS_UNIT else "1")
                for index in indices
            ]
            rows.append([item.info.name, name, *own, None, None, None, *about])
        for pair in item.pairs:
            first, second, nothing = names[pair.first], names[pair.second], [None] * len(indices)
            rows.append([item.info.name, first, *nothing, second, pair.index, pair.error, *about])
    return exports.table_csv(header, zip(*rows, strict=True) if rows else [[] for _ in header])
