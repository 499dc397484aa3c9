"""The sketch of a study's machine as pictures that stand alone: the one that forms show, in the colours of paper."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from sprag.service.figures.linkage import drawings
from sprag.service.languages import N_, gettext, ngettext
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.worker.study import Study

_COLOURS: Final = {
    "ink": "#1b1f24", "strong": "#5c6570", "line": "#c3c9d1", "accent": "#0072b2", "bad": "#b3261e",
    "mass": "#dbe3ec", "paper": "#ffffff",
}  # fmt: skip
_STYLE: Final = """<style>text{font-family:sans-serif;font-size:14px;font-style:italic;fill:#1b1f24}
.guide{fill:none;stroke:#c3c9d1;stroke-width:1.5;stroke-dasharray:4 4}.ground{fill:none;stroke:#1b1f24}
.plate{fill:#dbe3ec;stroke:#5c6570;stroke-width:1.5}.link{fill:none;stroke:#1b1f24;stroke-width:4}
.crank{stroke:#d55e00}.pin{fill:#ffffff;stroke:#1b1f24;stroke-width:1.5}</style>"""


def sketches(study: Study) -> list[tuple[str, bytes]]:
    """What each picture is, and the picture as SVG; nothing for machines that have none."""
    environment = Environment(
        loader=PackageLoader("sprag.service.report"),
        autoescape=True,
        extensions=["jinja2.ext.i18n"],
        undefined=StrictUndefined,
    )
    # What the extension for texts adds.
    environment.install_gettext_callables(gettext, ngettext, newstyle=True)  # type: ignore[attr-defined]
    if models.has_clutches(study):
        page = environment.get_template("_sketch.html").render()
        return [(N_("Pendulum, freewheel clutch and shaft"), _alone(svg)) for svg in _pictures(page)]
    drawn = drawings(study, 60.0) if study.structure else ()
    page = environment.get_template("_linkage.html").render(drawings=drawn)
    return [(one.title, _alone(svg)) for one, svg in zip(drawn, _pictures(page), strict=True)]


def _pictures(page: str) -> list[str]:
    return re.findall(r"<svg.*?</svg>", page, re.DOTALL)


def _alone(svg: str) -> bytes:
    """The picture with its name space and colours, which the style sheet of a page gives it otherwise."""
    for name, colour in _COLOURS.items():
        svg = svg.replace(f"var(--{name})", colour)
    width, height = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg).groups()  # type: ignore[union-attr]
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}"'
    svg = svg.replace("<svg", head, 1)
    return svg.replace(">", f">{_STYLE}", 1).encode()
