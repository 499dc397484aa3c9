"""Curves and maps from the parameters of an address; what it leaves out has useful defaults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import parse_qsl

import numpy as np

from sprag_study.service.faults import refused
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.results.curves import CurveQuery, Pairs
from sprag_study.service.results.defaults import (
    MOST_CHOICES,
    listed_held,
    main_query,
    main_results,
    many_values,
    usual_value,
    varying_axes,
)
from sprag_study.service.results.refined import curve_plan, families, plan_along
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.selection import locate_axes, value_of
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP

if TYPE_CHECKING:
    from sprag_study.worker.study import Study


class Given(Protocol):
    """Parameters of an address: the last value of a name, and all of them."""

    def get(self, key: str, /) -> str | None:
        """The last value; None where there is none."""

    def getlist(self, key: str, /) -> list[str]:
        """All values in order."""


class Address:
    """The parameters of a query text such as ``x=shaft.load&y=efficiency``; those without a value are left out."""

    def __init__(self, query: str = "") -> None:
        self.pairs = parse_qsl(query)

    def get(self, key: str, /) -> str | None:
        """The last value; None where there is none."""
        return next((value for name, value in reversed(self.pairs) if name == key), None)

    def getlist(self, key: str, /) -> list[str]:
        """All values in order."""
        return [value for name, value in self.pairs if name == key]


@dataclass(frozen=True, slots=True)
class MapQuery:
    """A map: one result over two axes, the others held."""

    x: str
    y: str
    z: str
    at: Pairs


def characteristic(study: Study) -> CurveQuery | None:
    """The mechanical characteristic: speed, torque, power and efficiency along the study's main axis."""
    main = main_query(study)
    if main is None or curve_plan(study) is not None:
        return main  # refined curves are right for the results that were asked for
    return CurveQuery(main.x, main_results(study), main.by, main.at, of=main.of)


def curve_query(study: Study, given: Given) -> CurveQuery | None:
    """The curves requested by a URL; None for a study whose cases lie on no curves.

    Open axes are held at their usual value. Invalid choices are left for `select` to refuse.
    """
    main = main_query(study)
    if main is None:
        return None
    x = given.get("x") or main.x
    y = tuple(name for name in given.getlist("y") if name) or main.y
    by = tuple(path for path in given.getlist("by") if path) if given.get("x") else main.by
    by = tuple(path for path in by if not _same_axis(study, path, x))
    at = held(study, given.getlist("at"), (x, *by))
    return CurveQuery(x, y, by, at, of=_family(study, given, main, by, at))


def _family(study: Study, given: Given, main: CurveQuery, by: tuple[str, ...], at: Pairs) -> Pairs:
    """The values that have a curve: as given, those of the main curves, some of an axis with many; () for all."""
    chosen = tuple((path, value) for path, _, value in (item.partition("=") for item in given.getlist("of") if item))
    chosen = tuple(pair for pair in chosen if any(_same_axis(study, pair[0], path) for path in by))
    if curve_plan(study) is not None:
        return chosen
    if given.get("every"):
        return tuple(pair for path in by for pair in many_values(study, path, MOST_CHOICES, at))
    if by == main.by:
        return chosen or main.of
    return chosen or tuple(pair for path in by for pair in many_values(study, path, at=at))


def value_choices(study: Study, query: CurveQuery) -> list[dict[str, Any]]:
    """For each axis of by of which some values are drawn: its values, and which of them are."""
    found = []
    for path in dict.fromkeys(path for path, _ in query.of):
        axis = study.axis_with(path)
        unit, texts = unit_of(study, path), [text for own, text in query.of if own == path]
        places = {axis.index_of(value_of(path, text, unit, "of")) for text in texts}
        drawn = {axis.value(place) for place in places if place is not None}
        values = np.unique(axis.array).tolist()
        listed = values if len(values) <= MOST_CHOICES else sorted(drawn)
        found.append(
            {
                "path": path,
                "unit": unit,
                "of": len(values),
                "values": [(value, value in drawn) for value in listed],
            }
        )
    return found


def map_query(study: Study, given: Given) -> MapQuery | None:
    """The map requested by a URL; None where fewer than two axes vary."""
    plan = map_plan(study)
    if plan is not None:
        x, y = (axis.paths[0] for axis in plan.adaptive)
        along = [path for path in models.presentation_of(study).along if path in study.axis_paths]
        if along and along[0] in plan.adaptive[1].paths:
            x, y = y, x
        if given.get("x") == y or given.get("y") == x:
            x, y = y, x
        x, y, z = given.get("x") or x, given.get("y") or y, given.get("z") or plan.results[0]
        return MapQuery(x, y, z, held(study, given.getlist("at"), (x, y)))
    varying = varying_axes(study)
    main = main_query(study)
    if main is None or study.combine != "grid" or len(varying) < 2:
        return None
    x = given.get("x") or main.x
    others = [axis.paths[0] for axis in varying if not _same_axis(study, axis.paths[0], x)]
    y = given.get("y") or (main.by[0] if main.by and main.by[0] != x else others[0])
    if _same_axis(study, y, x):
        y = others[0]
    return MapQuery(x, y, given.get("z") or main.y[0], held(study, given.getlist("at"), (x, y), one_direction=True))


def held(study: Study, given: Sequence[str], drawn: Sequence[str], *, one_direction: bool = False) -> Pairs:
    """Pairs of path and value for the axes that are not drawn: as given, others at their usual value.

    The direction of a sweep is left open unless ``one_direction``: curves show both. Of listed cases, axes that make
    few curves are left open too.
    """
    pairs: dict[str, str] = {}
    for item in given:
        path, equals, value = item.partition("=")
        if not item or any(_same_axis(study, path, name) for name in drawn):
            continue
        if not equals or not value.strip():
            raise refused("at", "invalid-text", "must be path=value", item)
        pairs[path.strip()] = value.strip()
    plan = plan_along(study, drawn[0]) or map_plan(study)
    if plan is None and study.combine == "zip":
        return (*pairs.items(), *_listed_held(study, drawn, pairs))
    fixed = families(plan) if plan is not None else study.axis_paths
    for axis in study.axes:
        if axis.paths == (SWEEP,) and not one_direction:
            continue
        if len(axis) > 1 and axis.paths[0] in fixed and not any(path in axis.paths for path in (*drawn, *pairs)):
            pairs[axis.paths[0]] = repr(usual_value(study, axis))
    return tuple(pairs.items())


def _listed_held(study: Study, drawn: Sequence[str], given: Mapping[str, str]) -> Pairs:
    """Values of the axes of listed cases that are neither ``drawn`` (x first) nor ``given``."""
    fixed = locate_axes(study, tuple(given.items()))
    x, *by = (study.axis_of(path) for path in drawn)
    if x is None:
        return ()
    values = {position: [study.axes[position].value(index)] for position, (_, index) in fixed.items()}
    return listed_held(study, x, [position for position in by if position is not None], values)


def pairs_of(query: CurveQuery | MapQuery) -> list[tuple[str, str]]:
    """The query as parameters of a URL."""
    at = [("at", f"{path}={value}") for path, value in query.at]
    if isinstance(query, MapQuery):
        return [("x", query.x), ("y", query.y), ("z", query.z), *at]
    of = [("of", f"{path}={value}") for path, value in query.of]
    return [("x", query.x), *(("y", name) for name in query.y), *(("by", path) for path in query.by), *at, *of]


def _same_axis(study: Study, first: str, second: str) -> bool:
    position = study.axis_of(first)
    return first == second or (position is not None and position == study.axis_of(second))
