"""A small picture of curves as SVG, without a plotting library."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from os import PathLike
from pathlib import Path
from typing import Final

from sprag_study.service.client.errors import ArgumentError
from sprag_study.service.formats import PICTURES

#: x and y of one curve; None and NaN leave a gap.
Line = tuple[Sequence[float | None], Sequence[float | None]]

_WIDTH, _HEIGHT = 360, 150
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 10, 10, 34
_COLOURS: Final = ("#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b")
#: More curves would be a smear.
_MOST: Final = 12


@dataclass(frozen=True, slots=True, repr=False)
class Picture:
    """A picture, which notebooks show where it is SVG or PNG; ``form`` is "svg", "png" or "pdf"."""

    content: bytes
    form: str = "svg"

    def __repr__(self) -> str:
        return f"Picture({self.form.upper()}, {len(self.content):,} bytes)"

    @property
    def svg(self) -> bytes:
        """The content of an SVG; AttributeError where the picture is a PNG or a PDF, which is in ``content``."""
        if self.form != "svg":
            raise AttributeError(f"the picture is a {self.form.upper()}: its bytes are `content`")
        return self.content

    def _repr_svg_(self) -> str | None:
        return self.content.decode() if self.form == "svg" else None

    def _repr_png_(self) -> bytes | None:
        return self.content if self.form == "png" else None

    def save(self, file: str | PathLike[str]) -> None:
        """Write the picture to a file; ArgumentError where its name ends like another format."""
        known = Path(file).suffix[1:].lower()
        if known in PICTURES and known != self.form:
            raise ArgumentError("file", str(file), f".{self.form}, or this name as `file` of `plot`")
        Path(file).write_bytes(self.content)


def sketch(x_caption: str, y_caption: str, lines: Sequence[Line]) -> str:
    """The curves between their extremes, with the extremes written at the axes."""
    drawn = [_known(line) for line in lines[:_MOST]]
    points = [point for runs in drawn for run in runs for point in run]
    if not points:
        return f"<p>{escape(y_caption)}: no values</p>"
    xs, ys = _range([x for x, _ in points]), _range([y for _, y in points])
    parts = [
        f'<svg role="img" aria-label="{escape(y_caption)} against {escape(x_caption)}" width="{_WIDTH}" '
        f'height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" fill="none" font-family="sans-serif" font-size="10">',
        f'<path stroke="currentColor" d="M{_LEFT} {_TOP}V{_HEIGHT - _BOTTOM}H{_WIDTH - _RIGHT}"/>',
        *_captions(x_caption, y_caption, xs, ys),
    ]
    for index, runs in enumerate(drawn):
        for run in runs:
            places = " ".join(f"{_across(x, xs):.1f},{_up(y, ys):.1f}" for x, y in run)
            pen = f'stroke="{_COLOURS[index % len(_COLOURS)]}" stroke-width="1.5" stroke-linecap="round"'
            parts.append(f'<polyline {pen} points="{places}"/>')
    more = f"<small>{_MOST} of {len(lines)} curves</small>" if len(lines) > _MOST else ""
    return "".join([*parts, "</svg>", more])


def _known(line: Line) -> list[list[tuple[float, float]]]:
    """The stretches of a curve without gaps."""
    runs: list[list[tuple[float, float]]] = [[]]
    for x, y in zip(*line, strict=True):
        if x is None or y is None or not (math.isfinite(x) and math.isfinite(y)):
            runs.append([])
        else:
            runs[-1].append((x, y))
    return [run for run in runs if run]


def _range(values: Sequence[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    return (low, high) if high > low else (low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0))


def _across(x: float, ends: tuple[float, float]) -> float:
    return _LEFT + (_WIDTH - _LEFT - _RIGHT) * (x - ends[0]) / (ends[1] - ends[0])


def _up(y: float, ends: tuple[float, float]) -> float:
    return _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * (y - ends[0]) / (ends[1] - ends[0])


def _captions(x: str, y: str, xs: tuple[float, float], ys: tuple[float, float]) -> list[str]:
    base = _HEIGHT - _BOTTOM + 12
    texts = [
        (_LEFT, base, "start", f"{xs[0]:.3g}"),
        (_WIDTH - _RIGHT, base, "end", f"{xs[1]:.3g}"),
        (_LEFT - 4, _HEIGHT - _BOTTOM, "end", f"{ys[0]:.3g}"),
        (_LEFT - 4, _TOP + 8, "end", f"{ys[1]:.3g}"),
        ((_LEFT + _WIDTH - _RIGHT) // 2, _HEIGHT - 6, "middle", f"{y} against {x}"),
    ]
    return [
        f'<text fill="currentColor" x="{across}" y="{up}" text-anchor="{anchor}">{escape(text)}</text>'
        for across, up, anchor, text in texts
    ]
