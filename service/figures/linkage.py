"""The mechanisms and the train of a machine shaft as drawings: still at one angle, with the frames that move them."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.figures.drawing import Dimension, Drawing
from sprag_study.service.languages import N_, gettext
from sprag_study.service.reading.reader import titled
from sprag_study.worker.models import machine_shaft

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from sprag_study.worker.arrays import Floats

    Place = tuple[float, float]

#: Degrees of the shaft from one frame to the next.
STEP: Final = 5
#: Largest width and height of a drawing, and its margin.
_WIDTH, _HEIGHT, _MARGIN = 420.0, 260.0, 24.0
_ROUNDED: Final = 1
#: Name of the angle of the guides.
_INCLINATION: Final = "inclination"
#: From a bar to the middle of a letter beside it (px).
_BESIDE: Final = 14.0
#: Of the train: distance of two shafts, height of its axis, and the largest radius of a wheel (px).
_APART, _LEVEL, _LARGE = 84.0, 58.0, 30.0
#: Length of a shaft between stages for a flywheel (px).
_WHEEL_APART: Final = 56.0
#: From the top of a part of the train to the middle of its letter (px).
_ABOVE: Final = (0.0, -9.0)
_STAGES: Final = {
    "gear": N_("gear"), "worm": N_("worm gear"), "belt": N_("belt"), "chain": N_("chain"), "screw_nut": N_("screw"),
    "rack": N_("rack"), "coupling": N_("coupling"),
}  # fmt: skip


def machine_drawings(
    structure: Mapping[str, Any], base: Mapping[str, float], angle: float, width: float | None = None
) -> tuple[Drawing, ...]:
    """The train of a machine, where it has more than a shaft, and each mechanism at an angle of the shaft (degrees).

    A mechanism is at most ``width`` px wide; one whose links do not reach has no drawing.
    """
    symbols = {path: entry.symbol for path, entry in machine_shaft.parameters_of(structure).items()}
    several = "parts" in structure
    found = list(_train(structure, base))
    for index, (sketch, ratio) in enumerate(_sketches(structure, base, angle)):
        part = structure["parts"][index] if several else structure
        if not all(np.isfinite(points).all() for points in sketch.joints.values()):
            continue
        mechanism = part["mechanism"]
        kind = str(mechanism["kind"])
        plain = kind in {"none", "table", "formula"}
        title = gettext("Shaft") if plain else titled(kind)
        if kind == "quick_return":
            title = f"{title} ({titled(mechanism[kind])})"
        at = f"parts.{index}." if several else ""
        title = _of_part(index + 1, title) if several else title
        title = title if ratio == 1.0 else f"{title} (i = {ratio:.4g})"
        found.append(_drawing(title, sketch, f"{at}mechanism", kind, width or _WIDTH, ratio))
    return tuple(drawing.labelled(symbols) for drawing in found)


def _sketches(
    structure: Mapping[str, Any], base: Mapping[str, float], angle: float
) -> Iterator[tuple[machine_shaft.Sketch, float]]:
    """Each mechanism over a turn of its shaft and then at an angle of the main shaft (degrees), and its ratio."""
    turn, cycle = np.arange(0.0, 360.0 + STEP, STEP), structure.get("cycle", 1)
    every = [part.get("turns", cycle) / cycle for part in structure.get("parts", ({},))]
    drawn = {
        ratio: machine_shaft.sketches_of(
            structure, base, np.radians(np.append(turn / ratio, math.fmod(angle, 360.0 / ratio)))
        )
        for ratio in dict.fromkeys(every)
    }
    for index, ratio in enumerate(every):
        yield drawn[ratio][index], ratio


def _of_part(number: int, title: str) -> str:
    return gettext("Part {number}: {title}", number=number, title=title.lower())


def _drawing(title: str, sketch: machine_shaft.Sketch, at: str, kind: str, largest: float, ratio: float) -> Drawing:
    """The drawing of a sketch, whose last angle is that of the still, at most ``largest`` px wide.

    ``ratio`` is the speed of its shaft over that of the main shaft.
    """
    reach = [*sketch.joints.values(), *sketch.guides]
    for plate in sketch.plates:
        size = float(np.hypot(*plate.outline.T).max())
        reach += [sketch.joints[plate.joint] + offset for offset in (-size, size)]
    every = np.concatenate(reach)
    low, high = every.min(axis=0), every.max(axis=0)
    span = np.maximum(high - low, 1e-12)
    scale = float(min((largest - 2.0 * _MARGIN) / span[0], (_HEIGHT - 2.0 * _MARGIN) / span[1]))

    def placed(points: Floats) -> Floats:
        return np.asarray(np.round((points - (low[0], high[1])) * (scale, -scale) + _MARGIN, _ROUNDED))

    joints = {name: placed(points) for name, points in sketch.joints.items()}
    turns: dict[str, Floats] = {
        name: np.asarray(np.round(-np.degrees(np.unwrap(values)), _ROUNDED)) for name, values in sketch.turns.items()
    }
    frames: dict[str, Any] = {} if ratio == 1.0 else {"ratio": ratio}
    frames |= {
        "joints": {name: points[:-1].tolist() for name, points in joints.items()},
        "turns": {name: values[:-1].tolist() for name, values in turns.items()},
    }
    guides = [placed(line) for line in sketch.guides]
    width, height = (round(float(own) * scale + 2.0 * _MARGIN, 1) for own in span)
    return Drawing(
        title,
        gettext("Drawing of the mechanism: {title}", title=title.lower()),
        width,
        height,
        "".join(_shapes(sketch, joints, turns, guides, scale)),
        tuple(_dimensions(sketch, joints, guides, f"{at}.{kind}.", width, scale)),
        json.dumps(frames, separators=(",", ":")),
        at,
    )


def _shapes(
    sketch: machine_shaft.Sketch,
    joints: dict[str, Floats],
    turns: dict[str, Floats],
    guides: list[Floats],
    scale: float,
) -> Iterator[str]:
    for line in guides:
        yield f'<polyline class="dashed" points="{_points(line)}"/>'
    pivots = [(float(joints[name][-1][0]), float(joints[name][-1][1])) for name in sketch.pivots]
    for x, y in pivots:
        yield f'<path class="body" d="M{x:g} {y:g}l-9 14h18zM{x - 14:g} {y + 14:g}h28"/>'
    for plate in sketch.plates:
        x, y = joints[plate.joint][-1]
        turn = f"translate({x:g} {y:g}) rotate({turns[plate.turn][-1] % 360.0:g})"
        outline = _points(np.round(plate.outline * (scale, -scale), _ROUNDED))
        moves = f"{plate.joint} {plate.turn}"
        yield f'<polygon class="mass" data-plate="{moves}" transform="{turn}" points="{outline}"/>'
    for bar in sketch.bars:
        crank = " crank" if bar.about == ("crank",) else ""
        still = _points([joints[name][-1] for name in bar.joints])
        yield f'<polyline class="rod{crank}" data-bar="{" ".join(bar.joints)}" points="{still}"/>'
    for x, y in pivots:
        yield f'<circle class="pin" cx="{x:g}" cy="{y:g}" r="4.5"/>'
    for name in joints:
        if name not in sketch.pivots:
            x, y = joints[name][-1]
            yield f'<circle class="pin" r="3.5" data-joint="{name}" cx="{x:g}" cy="{y:g}"/>'


def _dimensions(
    sketch: machine_shaft.Sketch, joints: dict[str, Floats], guides: list[Floats], prefix: str, width: float,
    scale: float,
) -> Iterator[Dimension]:  # fmt: skip
    """The numbers that bars and plates stand for: along each bar, and one below the other in a plate.

    Their letters are beside the bar, and beside the plate. The inclination of a plate is that of its guides.
    """
    for bar in sketch.bars:
        first, last = joints[bar.joints[0]][-1], joints[bar.joints[-1]][-1]
        for index, name in enumerate(bar.about):
            share = (index + 1.0) / (len(bar.about) + 1.0)
            x, y = first + (last - first) * share
            dimension = _at(f"{prefix}{name}", float(x), float(y), width)
            on = f"{bar.joints[0]} {bar.joints[-1]} {share:.3g} 0"
            yield replace(dimension, apart=_across(last - first, dimension.side), on=on)
    known = {name for bar in sketch.bars for name in bar.about}
    for plate in sketch.plates:
        x, y = joints[plate.joint][-1]
        own = [name for name in plate.about if name not in known]
        known |= set(own)
        half = float(np.abs(plate.outline[:, 0]).max()) * scale + _BESIDE / 2
        if guides and _INCLINATION in own:
            own.remove(_INCLINATION)
            yield _at_end(f"{prefix}{_INCLINATION}", guides, joints["O"][-1], width)
        for index, name in enumerate(own):
            dimension = _at(f"{prefix}{name}", float(x), float(y) + 15.0 * index, width)
            apart = (-half if dimension.side == "left" else half, 0.0)
            yield replace(dimension, apart=apart, on=f"{plate.joint} {plate.joint} 0 {15 * index}")


def _at_end(path: str, guides: list[Floats], shaft: Floats, width: float) -> Dimension:
    """A number of the guides, at their end that is farthest from the shaft."""
    ends = np.concatenate([line[[0, -1]] for line in guides])
    x, y = ends[int(np.argmax(np.hypot(*(ends - shaft).T)))]
    dimension = _at(path, float(x), float(y), width)
    return replace(dimension, apart=(-_BESIDE if dimension.side == "left" else _BESIDE, 0.0))


def _across(along: Floats, side: str) -> tuple[float, float]:
    """From a bar to the middle of a letter beside it, on one side (px)."""
    normal = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    turned = -1.0 if (normal[0] > 0.0) == (side == "left") else 1.0
    x, y = normal * turned * _BESIDE
    return round(float(x), 1), round(float(y), 1)


def _at(path: str, x: float, y: float, width: float) -> Dimension:
    return Dimension(path, "", round(x, 1), round(y, 1), "left" if x < width / 2 else "right")


def _train(structure: Mapping[str, Any], base: Mapping[str, float]) -> Iterator[Drawing]:
    """The motor, the stages and the flywheel on its shaft, from left to right; none of a shaft alone.

    Radii of the wheels of a stage are in its ratio, as far as there is room.
    """
    drive = structure.get("drive", {})
    stages = list(drive.get("stages", ()))
    if not (drive.get("motor") or stages or drive.get("flywheel")):
        return
    shapes, dimensions = list[str](), list[Dimension]()
    x = 16.0
    if drive.get("motor"):
        x = 70.0
        shapes.append(_box(x - 30.0, gettext("Motor")))
        names = [path for path in base if path.startswith("drive.motor.")]
        dimensions += [Dimension(path, "", x - 30.0, _LEVEL - 18.0, "right", _ABOVE) for path in names[:1]]
    on = drive.get("flywheel_shaft", len(stages)) if drive.get("flywheel") else None
    for index, kind in enumerate(stages):
        if on == index:
            shapes += [_line(x, x + _WHEEL_APART), *_flywheel(x + _WHEEL_APART / 2)]
            dimensions += _flywheel_numbers(x + _WHEEL_APART / 2, base)
            x += _WHEEL_APART
        wheels = _wheels(kind, x + _APART / 2, base.get(f"drive.stages.{index}.ratio", 1.0))
        shapes += [_line(x, x + _APART), *_stage(kind, x + _APART / 2, wheels)]
        named = ("ratio", "lead", "radius", "stiffness")
        name = next((own for own in named if f"drive.stages.{index}.{own}" in base), "inertia")
        place, radius = max(wheels, key=lambda wheel: wheel[1])
        dimensions.append(Dimension(f"drive.stages.{index}.{name}", "", place, _LEVEL - radius, "right", _ABOVE))
        x += _APART
    end = x + _APART
    shapes.append(_line(x, end))
    if on == len(stages):
        shapes += _flywheel(x + _APART / 2)
        dimensions += _flywheel_numbers(x + _APART / 2, base)
    shapes.append(f'<circle class="solid" cx="{end:g}" cy="{_LEVEL:g}" r="4"/>')
    about = gettext("Drawing of the train: from the motor to the shaft of the machine")
    width = end + 24.0
    sided = tuple(replace(each, side="left" if each.x < width / 2 else "right") for each in dimensions)
    yield Drawing(gettext("Train"), about, width, 2 * _LEVEL, "".join(shapes), sided, at="drive")


def _flywheel(x: float) -> Iterator[str]:
    yield f'<rect class="mass" x="{x - 6:g}" y="{_LEVEL - 36:g}" width="12" height="72"/>'


def _flywheel_numbers(x: float, base: Mapping[str, float]) -> Iterator[Dimension]:
    for name, y in (("mass", -28.0), ("width", -28.0), ("diameter", 28.0)):
        if f"drive.flywheel.{name}" in base:
            yield Dimension(f"drive.flywheel.{name}", "", x + 6, _LEVEL + y, "right")


def _line(start: float, end: float) -> str:
    return f'<path class="body" stroke-width="3" d="M{start:g} {_LEVEL:g}H{end:g}"/>'


def _box(x: float, title: str) -> str:
    return (
        f'<rect class="mass" x="{x - 30:g}" y="{_LEVEL - 18:g}" width="60" height="36" rx="4"/>'
        f'<text x="{x:g}" y="{_LEVEL + 4:g}" text-anchor="middle">{title}</text>'
    )


def _wheels(kind: str, x: float, ratio: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Places along the shaft and radii of the two wheels of a stage (px)."""
    if kind == "coupling":
        return (x - 5.0, 20.0), (x + 5.0, 20.0)
    share = ratio if math.isfinite(ratio) and ratio > 0.0 else 1.0
    small, large = (_LARGE / share, _LARGE) if share >= 1.0 else (_LARGE, _LARGE * share)
    small, large = (max(own, 6.0) for own in (small, large))
    apart = (small + large) / 2 if kind in {"gear", "worm"} else 22.0
    return (x - apart, small), (x + apart, large)


def _stage(kind: str, x: float, wheels: tuple[tuple[float, float], tuple[float, float]]) -> Iterator[str]:
    """Two wheels of a stage; belts and chains go round both. A coupling is two discs from the side."""
    (left, small), (right, large) = wheels
    for place, radius in wheels:
        if kind == "coupling":
            yield f'<rect class="mass" x="{place - 3:g}" y="{_LEVEL - radius:g}" width="6" height="{2 * radius:g}"/>'
        else:
            yield f'<circle class="wheel" cx="{place:g}" cy="{_LEVEL:g}" r="{radius:g}"/>'
    if kind in {"belt", "chain"}:
        ends = (
            f"{left:g} {_LEVEL - small:g}L{right:g} {_LEVEL - large:g}",
            f"{left:g} {_LEVEL + small:g}L{right:g} {_LEVEL + large:g}",
        )
        yield f'<path class="body" d="M{ends[0]}M{ends[1]}"/>'
    yield f'<text x="{x:g}" y="{2 * _LEVEL - 6:g}" text-anchor="middle">{gettext(_STAGES.get(kind, kind))}</text>'


def _points(points: Sequence[Floats] | Floats) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in points)
