"""The mechanisms of a machine shaft as drawings in SVG: still at one angle, with the frames that move them."""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.languages import gettext
from sprag.service.reading.reader import titled
from sprag.service.reading.wording import symbol
from sprag.worker.models import machine_shaft

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag.worker.study import Study

    Floats = NDArray[np.float64]
    Place = tuple[float, float]

#: Degrees of the shaft from one frame to the next.
STEP: Final = 5
#: Largest width and height of a drawing, and its margin.
_WIDTH, _HEIGHT, _MARGIN = 420.0, 260.0, 22.0
_ROUNDED: Final = 1
_PRINTED: Final = re.compile(r"<i>(.*)</i>(?:<sub>(.*)</sub>)?")


@dataclass(frozen=True, slots=True)
class Shape:
    """A bar, plate or label: ``moves`` are the joints it goes through, or its joint and the name of its turn.

    ``at`` is its place at the still's angle: the points of a bar, the transform of a plate, (x, y) of a label, which is
    a letter with its index.
    """

    moves: str
    at: str
    about: str = ""
    outline: str = ""
    label: tuple[str, str] = ("", "")


@dataclass(frozen=True, slots=True)
class Drawing:
    """One mechanism: sizes in px; ``frames`` are the joints and turns every `STEP` degrees of the shaft, as JSON."""

    title: str
    width: float
    height: float
    frames: str
    bars: tuple[Shape, ...]
    plates: tuple[Shape, ...]
    labels: tuple[Shape, ...]
    joints: tuple[Shape, ...]
    pivots: tuple[Place, ...]
    guides: tuple[str, ...]


def drawings(study: Study, angle: float) -> tuple[Drawing, ...]:
    """The mechanisms of a study's base at an angle of its shaft, in degrees; none where links do not reach."""
    if study.model != machine_shaft.MODEL:
        return ()
    structure = study.structure or {}
    angles = np.radians(np.append(np.arange(0.0, 360.0 + STEP, STEP), math.fmod(angle, 360.0)))
    several = "parts" in structure
    found = []
    for index, sketch in enumerate(machine_shaft.sketches_of(structure, study.base, angles)):
        mechanism = structure["parts"][index]["mechanism"] if several else structure["mechanism"]
        if not all(np.isfinite(points).all() for points in sketch.joints.values()):
            continue
        kind = str(mechanism["kind"])
        plain = kind in {"none", "table", "formula"}
        title = gettext("Shaft") if plain else titled(mechanism.get("quick_return", kind))
        prefix = f"{f'parts.{index}.' if several else ''}mechanism.{kind}."
        symbols = {
            path.removeprefix(prefix): entry.symbol
            for path, entry in machine_shaft.parameters_of(structure).items()
            if path.startswith(prefix)
        }
        found.append(_drawing(_of_part(index + 1, title) if several else title, sketch, symbols))
    return tuple(found)


def _of_part(number: int, title: str) -> str:
    return gettext("Part {number}: {title}", number=number, title=title.lower())


def _drawing(title: str, sketch: machine_shaft.Sketch, symbols: dict[str, str]) -> Drawing:
    """The drawing of a sketch, whose last angle is that of the still."""
    reach = [*sketch.joints.values(), *sketch.guides]
    for plate in sketch.plates:
        size = float(np.hypot(*plate.outline.T).max())
        reach += [sketch.joints[plate.joint] + offset for offset in (-size, size)]
    every = np.concatenate(reach)
    low, high = every.min(axis=0), every.max(axis=0)
    span = np.maximum(high - low, 1e-12)
    scale = float(min((_WIDTH - 2.0 * _MARGIN) / span[0], (_HEIGHT - 2.0 * _MARGIN) / span[1]))

    def placed(points: Floats) -> Floats:
        return np.asarray(np.round((points - (low[0], high[1])) * (scale, -scale) + _MARGIN, _ROUNDED))

    joints = {name: placed(points) for name, points in sketch.joints.items()}
    turns = {name: np.round(-np.degrees(np.unwrap(values)), _ROUNDED) for name, values in sketch.turns.items()}
    frames = {
        "joints": {name: points[:-1].tolist() for name, points in joints.items()},
        "turns": {name: values[:-1].tolist() for name, values in turns.items()},
    }
    bars = [Shape(" ".join(bar.joints), _points([joints[name][-1] for name in bar.joints]), " ".join(bar.about))
            for bar in sketch.bars]  # fmt: skip
    plates = []
    for plate in sketch.plates:
        x, y = joints[plate.joint][-1]
        turn = f"translate({x:g} {y:g}) rotate({turns[plate.turn][-1] % 360.0:g})"
        outline = _points(np.round(plate.outline * (scale, -scale), _ROUNDED))
        plates.append(Shape(f"{plate.joint} {plate.turn}", turn, " ".join(plate.about), outline))
    moving = [name for name in joints if name not in sketch.pivots]
    return Drawing(
        title=title,
        width=round(float(span[0]) * scale + 2.0 * _MARGIN, 1),
        height=round(float(span[1]) * scale + 2.0 * _MARGIN, 1),
        frames=json.dumps(frames, separators=(",", ":")),
        bars=tuple(bars),
        plates=tuple(plates),
        labels=tuple(_labels(sketch, joints, symbols)),
        joints=tuple(Shape(name, f"{joints[name][-1][0]:g} {joints[name][-1][1]:g}") for name in moving),
        pivots=tuple((float(joints[name][-1][0]), float(joints[name][-1][1])) for name in sketch.pivots),
        guides=tuple(_points(placed(line)) for line in sketch.guides),
    )


def _labels(sketch: machine_shaft.Sketch, joints: dict[str, Floats], symbols: dict[str, str]) -> list[Shape]:
    """The symbols of the bars, at their middles."""
    found = []
    for bar in sketch.bars:
        text = symbols.get(bar.about[0] if bar.about else "", "")
        if text:
            x, y = (joints[bar.joints[0]][-1] + joints[bar.joints[-1]][-1]) / 2.0
            printed = _PRINTED.fullmatch(str(symbol(text)))
            label = (text, "") if printed is None else (printed[1], printed[2] or "")
            found.append(Shape(f"{bar.joints[0]} {bar.joints[-1]}", f"{x:g} {y:g}", " ".join(bar.about), "", label))
    return found


def _points(points: Sequence[Floats] | Floats) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)
