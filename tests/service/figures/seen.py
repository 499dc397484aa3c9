"""What somebody sees in a picture: its texts, and curves and points in the units of its axes."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
_SVG = re.compile(r"<svg .*?</svg>", re.DOTALL)


@dataclass
class Curve:
    """A curve: its name, colour and dash, and the values of each stretch, shape (points, 2)."""

    name: str
    colour: str
    dash: str | None
    stretches: list[Numbers]

    @property
    def values(self) -> Numbers:
        """The values of all stretches."""
        return np.concatenate(self.stretches)


@dataclass
class Panel:
    """A panel: its curves, points of lines that nothing joins, the cases of its points, and its colours."""

    curves: list[Curve] = field(default_factory=list)
    cases: list[int] = field(default_factory=list)
    bands: list[tuple[float, float]] = field(default_factory=list)
    fills: list[str] = field(default_factory=list)
    points: dict[str, Numbers] = field(default_factory=dict)


@dataclass
class Seen:
    """A picture: its texts in their order, and its panels."""

    texts: list[str]
    panels: list[Panel]

    def has(self, *texts: str) -> bool:
        """Whether all of these are written, each in one or in several lines."""
        whole = " ".join(self.texts)
        return all(text in whole for text in texts)


def seen(drawn: str | bytes) -> Seen:
    """What a picture shows, of the pictures of a page the widest one."""
    text = drawn.decode() if isinstance(drawn, bytes) else drawn
    text = text.replace("&nbsp;", "\N{NO-BREAK SPACE}").removeprefix('<?xml version="1.0" encoding="UTF-8"?>')
    if not text.lstrip().startswith("<svg"):
        text = _SVG.findall(text)[-1]
    root = ElementTree.fromstring(text.replace(' xmlns="http://www.w3.org/2000/svg"', ""))
    panels = [_panel(element) for element in root.iter("g") if element.get("class") == "panel"]
    return Seen([element.text or "" for element in root.iter("text")], panels)


def chart_of(page: str) -> Seen:
    """What the chart of the sheet of a study shows."""
    return seen(page.partition('<figure id="chart"')[2].partition("</figure>")[0])


def _panel(element: ElementTree.Element) -> Panel:
    scales = [_scale(element.get(f"data-{axis}", "")) for axis in "xy"]
    found = Panel(fills=[shape.get("fill", "") for shape in element.iter() if shape.get("fill")])
    for path in element.iter("path"):
        if path.get("data-line") is None:
            continue
        if path.get("fill") != "none" or path.get("stroke-linecap") or path.get("stroke-width") == "2":
            found.points[path.get("data-line", "")] = _values(path.get("d", ""), scales)
            continue
        stretches = [_values(part, scales) for part in re.findall(r"M[^M]*", path.get("d", ""))]
        name, colour = path.get("data-line", ""), path.get("stroke", "")
        found.curves.append(Curve(name, colour, path.get("stroke-dasharray"), stretches))
    for shape in element.iter():
        if (case := shape.get("data-case")) is not None:
            found.cases.append(int(case))
        found.cases += [int(case) for case in shape.get("data-cases", "").split()]
    for shape in element.findall("rect"):
        if shape.get("fill-opacity"):
            left = float(shape.get("x", 0))
            ends = scales[0](np.array([left, left + float(shape.get("width", 0))]))
            found.bands.append((float(ends[0]), float(ends[1])))
    return found


def _scale(text: str) -> Callable[[Numbers], Numbers]:
    """The values at pixels of an axis."""
    low, high, start, end = map(float, text.split())
    return lambda pixels: low + (pixels - start) * (high - low) / (end - start)


def _values(part: str, scales: list[Callable[[Numbers], Numbers]]) -> Numbers:
    pixels = np.array([[float(number) for number in pair] for pair in re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", part)])
    return np.stack([scales[0](pixels[:, 0]), scales[1](pixels[:, 1])], axis=1)
