"""Ribbons and yields of a study with tolerances as bytes that are ready to be sent."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from sprag.service.jobs.reading import reading_of
from sprag.service.json_text import to_bytes
from sprag.service.results.defaults import drawn_results
from sprag.service.results.figures.read import read_figure, read_map
from sprag.service.results.figures.ribbons import ribbon_figure, ribbon_map, yield_figure, yield_map
from sprag.service.results.pictures.curves import draw_figure
from sprag.service.results.pictures.maps import draw_map
from sprag.service.results.tolerances.batch import Asked
from sprag.service.results.tolerances.ribbons import QUANTILES, Ribbon, ribbon
from sprag.service.results.tolerances.written import ribbon_csv, ribbon_json, yield_csv, yield_json
from sprag.service.results.tolerances.yields import Yield, yields
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.answers.tolerances import RibbonReport, YieldReport
    from sprag.service.jobs.library import Library
    from sprag.service.reading.reader import Choice
    from sprag.service.results.pictures.curves import Picture


@dataclass(frozen=True, slots=True)
class RibbonQuery:
    """Which ribbons: results (by default those drawn first), places, probabilities of quantiles."""

    y: tuple[str, ...] = ()
    asked: Asked = field(default_factory=Asked)
    quantiles: tuple[float, ...] = QUANTILES


@dataclass(frozen=True, slots=True)
class YieldQuery:
    """Which yield: conditions, places, number of worst drives."""

    conditions: tuple[str, ...]
    asked: Asked = field(default_factory=Asked)
    worst: int = 10


def ribbon_of(library: Library, study_id: str, query: RibbonQuery) -> Ribbon:
    """The ribbons of a study; raises StudyNotFound, and SelectionError as `ribbon` does."""
    study = library.store.study(study_id)
    infos = models.study_results(study)
    fetch = partial(library.store.rows_for_cases, study_id)
    return ribbon(study, infos, query.y or drawn_results(study, infos), query.asked, query.quantiles, fetch)


def yield_of(library: Library, study_id: str, query: YieldQuery) -> Yield:
    """The yields of a study; raises StudyNotFound, and SelectionError as `yields` does."""
    study = library.store.study(study_id)
    fetch = partial(library.store.rows_for_cases, study_id)
    return yields(study, models.study_results(study), query.conditions, query.asked, query.worst, fetch)


def ribbon_as_json(library: Library, study_id: str, query: RibbonQuery) -> bytes:
    """The ribbons as JSON text."""
    return to_bytes(ribbon_json(study_id, ribbon_of(library, study_id, query)))


def ribbon_as_csv(library: Library, study_id: str, query: RibbonQuery) -> bytes:
    """The ribbons as a table."""
    return ribbon_csv(ribbon_of(library, study_id, query))


def yield_as_json(library: Library, study_id: str, query: YieldQuery) -> bytes:
    """The yields as JSON text."""
    return to_bytes(yield_json(study_id, yield_of(library, study_id, query)))


def yield_as_csv(library: Library, study_id: str, query: YieldQuery) -> bytes:
    """The yields as a table."""
    return yield_csv(yield_of(library, study_id, query))


def ribbon_picture(
    library: Library, study_id: str, query: RibbonQuery, mapped: bool, choice: Choice, title: str, form: Picture
) -> bytes:
    """The ribbons as a picture, or a map of the first quantile of the query."""
    found, reading = ribbon_of(library, study_id, query), reading_of(library.store, study_id, choice)
    if mapped:
        return draw_map(read_map(ribbon_map(found, query.quantiles[0]), reading), title, form)
    return draw_figure(read_figure(ribbon_figure(found), reading), title, form)


def yield_picture(
    library: Library, study_id: str, query: YieldQuery, mapped: bool, choice: Choice, title: str, form: Picture
) -> bytes:
    """The yields as a picture: over the places, or as a map."""
    found, reading = yield_of(library, study_id, query), reading_of(library.store, study_id, choice)
    if mapped:
        return draw_map(read_map(yield_map(found), reading), title, form)
    return draw_figure(read_figure(yield_figure(found), reading), title, form)


def both(library: Library, study_id: str, ribbons: RibbonQuery, wanted: YieldQuery) -> tuple[RibbonReport, YieldReport]:
    """The answers with ribbons and yields, for a page."""
    found = ribbon_json(study_id, ribbon_of(library, study_id, ribbons))
    return found, yield_json(study_id, yield_of(library, study_id, wanted))
