"""The report as one self-contained HTML file with embedded pictures, ready to be printed."""

from __future__ import annotations

import base64
from functools import lru_cache
from typing import TYPE_CHECKING

from jinja2 import Environment, PackageLoader, StrictUndefined, Template

from sprag.service.results.pictures.curves import draw_curves, draw_figure
from sprag.service.results.pictures.maps import draw_map

if TYPE_CHECKING:
    from sprag.service.results.curves import Curves, Map
    from sprag.service.results.figures.figure import Figure
    from sprag.service.results.report.content import Report


@lru_cache(maxsize=1)
def _template() -> Template:
    environment = Environment(
        loader=PackageLoader("sprag.service.results.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number_text
    environment.filters["input"] = input_text
    environment.filters["picture"] = _picture
    environment.filters["figure"] = _figure
    environment.filters["map_picture"] = _map
    return environment.get_template("report.html")


def number_text(value: float | None) -> str:
    """A number for display, a dash for none."""
    return "–" if value is None else f"{value:.6g}"


def input_text(value: float | str | None) -> str:
    """An input for display: a number, or the name of a choice."""
    return value if isinstance(value, str) else number_text(value)


def _picture(curves: Curves) -> str:
    """The curves as an image embedded in the page."""
    return _embedded(draw_curves(curves, "", "svg"))


def _map(drawn: Map) -> str:
    """A map as an image embedded in the page."""
    return _embedded(draw_map(drawn, "", "svg"))


def _figure(figure: Figure) -> str:
    """A described figure as an image embedded in the page."""
    return _embedded(draw_figure(figure, "", "svg"))


def _embedded(svg: bytes) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(svg).decode("ascii")


def html_report(report: Report) -> bytes:
    """The page."""
    return _template().render(report=report).encode("utf-8")
