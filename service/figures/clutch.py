"""The law of a clutch as a described figure: torque over windup, with the measured points that it was fitted to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.figures.figure import Figure, Line, Panel, Quantity, colour_at
from sprag_study.service.reading.reader import Phrase
from sprag_study.service.reading.units import QuantityError, parse_quantity
from sprag_study.worker import models
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from sprag_study.worker.study import Study

_POINTS: Final = 160
_WINDUP, _TORQUE = Quantity(Phrase("windup"), "rad"), Quantity(Phrase("torque of the clutch"), "N*m")


def clutch_figure(study: Study, spec: Mapping[str, Any], largest: float) -> Figure | None:
    """The laws of the clutches of a study's base, up to the ``largest`` windup (rad) or the end of their data.

    None for a study without clutches, and where axes or formulas change their coefficients.
    """
    if not models.has_clutches(study):
        return None
    lines: list[Line] = []
    for prefix, given, name in _clutches(study, spec):
        law = _coefficients(study, prefix)
        limit = study.base.get(f"{prefix}windup_limit", 0.0)
        end = limit or largest
        if not law or not end > 0.0:
            continue
        u = np.linspace(0.0, end, _POINTS)
        colour = colour_at(len(lines) // 2)
        lines.append(
            Line(Phrase("{clutch}: law", clutch=name), u, models.clutch_torque(law, limit or end, u), colour, key=name)
        )
        points = _measured(given)
        if points is not None:
            label = Phrase("{clutch}: measured points", clutch=name)
            lines.append(Line(label, *points, colour, 1, key=name, joined=False))
    return Figure(_WINDUP, (Panel(_TORQUE, tuple(lines), x=_WINDUP),)) if lines else None


def _clutches(study: Study, spec: Mapping[str, Any]) -> Iterator[tuple[str, Any, str]]:
    """Prefix of the paths, the part of the spec, and a name of each clutch."""
    base = spec.get("base") or {}
    if "clutch.coefficients.0" in {*study.base, *study.axis_paths, *study.derive}:
        yield "clutch.", base.get("clutch"), Phrase("Clutch")
    pendulums = base.get("pendulums") or []
    for index, pendulum in enumerate(pendulums):
        prefix = f"pendulums.{index}.clutch."
        if f"{prefix}coefficients.0" in study.base:
            yield prefix, pendulum.get("clutch"), Phrase("Clutch of pendulum {index}", index=ordinal(index))


def _coefficients(study: Study, prefix: str) -> Sequence[float]:
    """Of the powers of the windup from 0 on; () where one of them has no single value."""
    paths = [path for path in (*study.base, *study.axis_paths, *study.derive) if path.startswith(f"{prefix}coeff")]
    if any(path in study.axis_paths or path in study.derive for path in paths):
        return ()
    return [study.base[f"{prefix}coefficients.{power}"] for power in range(len(set(paths)))]


def _measured(given: Any) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]] | None:
    """Windup and torque of the measured points; None where the law was given by its coefficients."""
    data = given.get("data") if isinstance(given, dict) else None
    if not data or given.get("angles_include_backlash"):
        return None
    try:
        rows = np.array([[parse_quantity(angle, "rad"), parse_quantity(torque, "N*m")] for angle, torque in data])
    except QuantityError:
        return None
    return np.asarray(rows[:, 0]), np.asarray(rows[:, 1])
