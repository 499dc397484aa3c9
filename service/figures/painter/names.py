"""Names that stand at their curves, where each finds a place without touching a curve or another text."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np

from sprag_study.service.figures.painter.elements import SMALL, text_width

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

#: Most curves of which some are named there, and the widest name: in px, or where a panel is wide, its share of the
#: width. A legend has the others.
MOST_NAMED: Final = 8
_WIDEST: Final = (190.0, 0.45)
#: Pixels between points that stand for a curve, from a curve to its name, and to the nearest other one at best.
_STEP: Final = 4.0
_NEAR: Final = 3.0
_FAR: Final = 26.0
_HEIGHT: Final = 12.0
#: Places along a curve at which its name may stand.
_PLACES: Final = 24
#: Places that are compared with the other curves in one go: often one of the first is free.
_AT_ONCE: Final = 12


class Box(NamedTuple):
    """A part of a panel (px)."""

    left: float
    top: float
    right: float
    bottom: float

    def touches(self, other: Box) -> bool:
        """Whether two boxes have a point in common."""
        return (
            self.left < other.right and other.left < self.right and self.top < other.bottom and other.top < self.bottom
        )


class Named(NamedTuple):
    """A name at a curve: its text, and where it begins on its base line (px)."""

    text: str
    x: float
    y: float
    bold: bool


def named_curves(
    curves: Sequence[tuple[str, Numbers, Numbers]],
    others: Sequence[tuple[Numbers, Numbers]],
    taken: Sequence[Box],
    size: tuple[float, float],
    chosen: int | None = None,
) -> list[Named]:
    """The names of curves that find places of their own; none where there are too many curves.

    Parameters
    ----------
    curves : names and points (px) of the curves that are named
    others : points of what is not named; names touch them neither
    taken : boxes of other texts
    size : width and height of the panel
    chosen : the curve whose name is bold
    """
    if len(curves) > MOST_NAMED:
        return []
    dots, widest = [dense(x, y) for _, x, y in curves], max(_WIDEST[0], _WIDEST[1] * size[0])
    rest = [dense(x, y) for x, y in others]
    boxes, found = list(taken), dict[int, Named]()
    # The curves with the fewest points have the fewest places.
    for index in sorted(range(len(curves)), key=lambda place: dots[place].shape[0]):
        name = curves[index][0]
        if not dots[index].shape[0] or text_width(name, SMALL) > widest:
            continue
        alien = np.concatenate([*(own for place, own in enumerate(dots) if place != index), *rest, np.empty((0, 2))])
        best = _best(name, dots[index], alien, boxes, size, bold=index == chosen)
        if best is not None:
            found[index] = Named(name, best.left, best.bottom - 2.0, index == chosen)
            boxes.append(best)
    return [found[index] for index in sorted(found)]


def clearest(places: Sequence[Box], lines: Sequence[Numbers], taken: Sequence[Box]) -> Box:
    """The first place that touches neither a line (by its points) nor what is taken, or the one farthest from lines.

    Where all are taken it is the last.
    """
    free = [box for box in places if not any(box.touches(other) for other in taken)] or [places[-1]]
    points = np.concatenate([*lines, np.empty((0, 2))])
    clear = distances(free, points)
    return next((box for box, far in zip(free, clear, strict=True) if far >= _NEAR), free[int(np.argmax(clear))])


def _best(
    name: str, own: Numbers, alien: Numbers, boxes: Sequence[Box], size: tuple[float, float], *, bold: bool
) -> Box | None:
    """The place of a name that is farthest from other curves; of equal ones the first."""
    places = _places(text_width(name, SMALL, bold=bold), own, size)
    best, clear = None, _NEAR
    while block := list(islice(places, _AT_ONCE)):
        vacant = [box for box in block if not any(box.touches(other) for other in boxes)]
        nears = distances(vacant, own)
        some = [(box, near) for box, near in zip(vacant, nears, strict=True) if near >= _NEAR - 1.0]
        rooms = distances([box for box, _ in some], alien)
        for (box, near), far in zip(some, rooms, strict=True):
            room = min(far, _FAR)
            # Its own curve is clearly the nearest one.
            if room > max(clear + 0.5, near + _NEAR):
                best, clear = box, room
        if clear >= _FAR:
            break
    return best


def _places(width: float, own: Numbers, size: tuple[float, float]) -> Iterator[Box]:
    """Boxes above and below points of a curve: at its ends first."""
    last = own.shape[0] - 1
    inside = np.linspace(0, last, _PLACES).astype(np.int64).tolist()
    for place in dict.fromkeys([last, 0, *inside[::-1]]):
        x, y = own[place].tolist()
        for left in dict.fromkeys((min(max(x - width / 2.0, 2.0), size[0] - width), x - width - 4.0, x + 4.0)):
            for top in (y - _HEIGHT - _NEAR - 2.0, y + _NEAR + 2.0):
                box = Box(left, top, left + width, top + _HEIGHT)
                if left >= 0.0 and box.right <= size[0] + 1.0 and top >= 0.0 and box.bottom <= size[1] - 1.0:
                    yield box


def distances(boxes: Sequence[Box], points: Numbers) -> list[float]:
    """Pixels from each box to the nearest of some points, shape (points, 2)."""
    if not points.size or not boxes:
        return [_FAR] * len(boxes)
    x, y = points.T
    left, top, right, bottom = np.array(boxes).T[:, :, None]
    across, up = np.clip(x, left, right), np.clip(y, top, bottom)
    across -= x
    up -= y
    across *= across
    up *= up
    across += up
    return np.sqrt(across.min(axis=1)).tolist()  # type: ignore[no-any-return]


def dense(x: Numbers, y: Numbers) -> Numbers:
    """Points along a curve, a few pixels apart."""
    known = np.isfinite(x) & np.isfinite(y)
    across, up = x[known], y[known]
    if across.size < 2:
        return np.stack([across, up], axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(across), np.diff(up)))])
    at = np.arange(0.0, along[-1] + _STEP, _STEP)
    return np.stack([np.interp(at, along, across), np.interp(at, along, up)], axis=1)
