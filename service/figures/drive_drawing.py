"""The drawing of a vibration drive: a pendulum on a shaken axis, its spring, its freewheel clutch, the output shaft.

Lengths of a pendulum and amplitudes are to the same scale; the sizes of its mass, wheel and shaft are not.
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Final

from sprag_study.service.figures.drawing import Dimension, Drawing
from sprag_study.service.languages import gettext
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Width of a drawing, the place of the axis in it, and the longest arm (px).
_WIDTH, _AXIS, _REACH = 176.0, 112.0, 216.0
#: Radii of the clutch wheel, of the shaft and of the mass; the place of the wall at which the spring is held.
_WHEEL, _SHAFT, _MASS, _WALL = 29.0, 13.0, 20.0, 26.0
#: The still stands at this angle (degrees), so that arm and vertical are apart.
_ANGLE: Final = 7.0
_TEETH: Final = 8
#: A gap of the teeth shows the backlash, enlarged so much and at most so wide (degrees).
_ENLARGED, _WIDEST = 30.0, 24.0
_MARGIN: Final = 26.0
#: Half lengths of the arrows of the base (px) are at least and at most this.
_ARROW: Final = (6.0, 34.0)
_PENDULUM: Final = re.compile(r"pendulums\.(\d+)\.")


def drive_drawings(base: Mapping[str, float]) -> tuple[Drawing, ...]:
    """A drawing for each pendulum of a drive with these numbers (SI, by path); what is missing counts as usual.

    Base and shaft have their dimensions in the first one.
    """
    several = sorted({int(found[1]) for path in base if (found := _PENDULUM.match(path))}) or [0]
    return tuple(_drawing(base, number, len(several) > 1, first=number == several[0]) for number in several)


def _drawing(base: Mapping[str, float], number: int, several: bool, *, first: bool) -> Drawing:
    prefix = f"pendulums.{number}."
    arm, spring_arm = (_finite(base.get(f"{prefix}{name}", 0.0)) for name in ("arm", "spring_arm"))
    longest = max(abs(arm), abs(spring_arm)) or 1.0
    scale = _REACH / longest
    up = max(arm, spring_arm, 0.0) * scale
    down = max(-arm, -spring_arm, 0.0) * scale
    above = max(up + _MASS, _WHEEL + 8.0)
    y = _MARGIN + above
    below = max(down + _MASS, _WHEEL + 20.0)
    arrows = y + below + 44.0
    height = arrows + 40.0
    mass_at, spring_at = _on_arm(y, arm * scale), _on_arm(y, spring_arm * scale)
    shapes = [
        f'<path class="dashed" d="M{_AXIS:g} {_MARGIN - 12:g}V{y + below:g}M{_AXIS - 44:g} {y:g}h88"/>',
        f'<g data-base="">{_spring(base, prefix, spring_at, spring_arm, scale)}',
        f'<g data-arm="" transform="rotate({-_ANGLE:g} {_AXIS:g} {y:g})">'
        f"{_pendulum(y, arm * scale, spring_arm * scale)}"
        f"{_wheel(y, base.get(f'{prefix}backlash', 0.0))}</g>",
        f'<g data-shaft=""><circle class="pin" cx="{_AXIS:g}" cy="{y:g}" r="{_SHAFT:g}"/>'
        f'<path class="body" d="M{_AXIS:g} {y:g}v{-_SHAFT:g}"/></g></g>',
        _load(y),
        _base(base, arrows, scale),
    ]
    dimensions = [
        Dimension(f"{prefix}spring_rate", "", (_WALL + spring_at[0]) / 2, spring_at[1], "left", (0.0, -18.0)),
        Dimension(f"{prefix}mass", "", mass_at[0] - 14, mass_at[1] - 10, "left", on="arm"),
        Dimension(f"{prefix}inertia", "", *_on_arm(y, 0.42 * arm * scale), "left", on="arm"),
        Dimension(f"{prefix}spring_arm", "", *_beside(y, spring_arm * scale, 0.78, 46.0), "right", on="arm"),
        Dimension(f"{prefix}arm", "", *_beside(y, arm * scale, 0.62, 30.0), "right", on="arm"),
        Dimension(f"{prefix}backlash", "", _AXIS + _WHEEL - 2, y - 12, "right", (24.0, -4.0), on="base"),
    ]
    if first:
        dimensions += [
            Dimension("excitation.frequency", "", 70.0, arrows - 22, "left"),
            Dimension("excitation.amplitude_x", "", 62.0, arrows, "left"),
            Dimension("excitation.amplitude_y", "", 76.0, arrows + 20, "left"),
            Dimension("shaft.inertia", "", _AXIS + 9, y + 9, "right", (6.0 - _WHEEL - _SHAFT, 28.0), on="base"),
            Dimension("shaft.load", "", _AXIS + 39, y + 16, "right", (8.0, 0.0)),
        ]
    title = (
        gettext("Pendulum {number}", number=ordinal(number))
        if several
        else gettext("Pendulum, freewheel clutch and shaft")
    )
    about = gettext("Drawing of the drive: a pendulum on a vibrating axis drives the shaft through a freewheel clutch")
    return Drawing(title, about, _WIDTH, round(height, 1), "".join(shapes), tuple(dimensions))


def _finite(value: float) -> float:
    return value if math.isfinite(value) else 0.0


def _on_arm(y: float, length: float) -> tuple[float, float]:
    """A point of the pendulum in its still, so far above its axis."""
    angle = math.radians(_ANGLE)
    return round(_AXIS - length * math.sin(angle), 1), round(y - length * math.cos(angle), 1)


def _beside(y: float, length: float, share: float, apart: float) -> tuple[float, float]:
    """A point of the dimension line of a length, which runs so far beside the pendulum."""
    angle = math.radians(_ANGLE)
    x, height = _on_arm(y, share * length)
    return round(x + apart * math.cos(angle), 1), round(height - apart * math.sin(angle), 1)


def _spring(base: Mapping[str, float], prefix: str, end: tuple[float, float], arm: float, scale: float) -> str:
    """The spring from the wall to the pendulum, nothing where there is none; its ``data-spring`` is its arm in px."""
    if not arm or not base.get(f"{prefix}spring_rate", 0.0):
        return ""
    x, y = end
    span = x - _WALL
    lead, coil = 0.16 * span, 0.085 * span
    turns = "".join(f"l{2 * coil if 0 < index < 4 else coil:.1f} {sign}" for index, sign in
                    enumerate(("9", "-18", "18", "-18", "9")))  # fmt: skip
    return (
        f'<path class="body" d="M{_WALL:g} {y - 20:g}v40"/><path class="thin" d="M{_WALL:g} {y - 14:g}l-7 7m7 3l-7 7m7 '
        f'3l-7 7"/><g transform="translate({_WALL:g} {y:g})"><path class="body" data-spring="{arm * scale:.1f}" '
        f'data-span="{span:.1f}" vector-effect="non-scaling-stroke" d="M0 0h{lead:.1f}{turns}H{span:.1f}"/></g>'
    )


def _pendulum(y: float, arm: float, spring_arm: float) -> str:
    """Rod, mass and the two dimension lines, upright; the drawing turns it."""
    ends = (arm, spring_arm, 0.0)
    rod = f'<path class="rod" d="M{_AXIS:g} {y - min(ends):.1f}V{y - max(ends):.1f}"/>'
    mass = f'<circle class="mass" cx="{_AXIS:g}" cy="{y - arm:.1f}" r="{_MASS:g}"/>'
    pin = f'<circle class="pin" cx="{_AXIS:g}" cy="{y - spring_arm:.1f}" r="4.5"/>' if spring_arm else ""
    lines = "".join(_measured(y, length, apart) for length, apart in ((arm, 30.0), (spring_arm, 46.0)) if length)
    return rod + mass + pin + lines


def _measured(y: float, length: float, apart: float) -> str:
    """A dimension line with its ends beside the rod."""
    x, end, tip = _AXIS + apart, y - length, math.copysign(8.0, length)
    return (
        f'<path class="measure" d="M{_AXIS + 6:g} {end:.1f}H{x + 5:g}M{_AXIS + 30:g} {y:g}H{x + 5:g}'
        f'M{x:g} {y:g}V{end:.1f}"/><path class="tip" d="M{x:g} {end:.1f}l-3 {tip:g}h6zM{x:g} {y:g}l-3 {-tip:g}h6z"/>'
    )


def _wheel(y: float, backlash: float) -> str:
    """The clutch wheel with its teeth, between which a gap shows the backlash."""
    gap = min(math.degrees(abs(_finite(backlash))) * _ENLARGED, _WIDEST)
    width = (360.0 / _TEETH - gap) * 0.62
    teeth = []
    for index in range(_TEETH):
        first = math.radians(360.0 * index / _TEETH)
        points = [
            (_AXIS + radius * math.cos(angle), y + radius * math.sin(angle))
            for radius, angle in ((28.0, first), (28.0, first + math.radians(width)), (16.5, first + math.radians(4.0)))
        ]
        teeth.append("M" + "L".join(f"{x:.1f} {own:.1f}" for x, own in points) + "z")
    return (
        f'<circle class="wheel" data-clutch="" cx="{_AXIS:g}" cy="{y:g}" r="{_WHEEL:g}"/>'
        f'<path class="solid" d="{"".join(teeth)}"/>'
    )


def _load(y: float) -> str:
    """The arrow of the load at the shaft."""
    x = _AXIS + 40.0
    return (
        f'<path class="body" d="M{x:g} {y + 10:g}a42 42 0 0 1 -22 28"/>'
        f'<path class="solid" d="M{x - 27:g} {y + 40:g}l10 -7 3 7z"/>'
    )


def _base(base: Mapping[str, float], y: float, scale: float) -> str:
    """The directions in which the base vibrates, their lengths to scale where they can be seen."""
    x, path, tips = 84.0, "", ""
    for name, along in (("amplitude_x", True), ("amplitude_y", False)):
        amplitude = abs(_finite(base.get(f"excitation.{name}", 0.0)))
        if not amplitude:
            continue
        half = min(max(amplitude * scale, _ARROW[0]), _ARROW[1]) + 7.0
        if along:
            path += f"M{x - half:g} {y:g}h{2 * half:g}"
            tips += f"M{x - half:g} {y:g}l7 -3v6zM{x + half:g} {y:g}l-7 -3v6z"
        else:
            path += f"M{x:g} {y - half:g}v{2 * half:g}"
            tips += f"M{x:g} {y - half:g}l-3 7h6zM{x:g} {y + half:g}l-3 -7h6z"
    return f'<path class="measure" d="{path}"/><path class="tip" d="{tips}"/>' if path else ""
