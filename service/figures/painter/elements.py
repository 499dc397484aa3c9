"""Elements of SVG: texts with their widths, paths, markers and colours."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.figures.figure import NEUTRAL, PALETTE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

#: Pixels of the letters of most texts, of small ones, and of a line of text.
SIZE: Final = 13.0
SMALL: Final = 12.0
LINE: Final = 17.0
#: Widths of letters in em, those of DejaVu Sans, which is wider than most fonts of browsers.
_WIDTHS: Final[Mapping[str, float]] = {
    letter: width
    for width, letters in {
        0.31: "'IJijlіїІЇ", 0.35: " \u00a0\u202f,./:;\\f|’·", 0.4: "!()[]t-²³⁰¹⁴⁵⁶⁷⁸⁹", 0.45: "r", 0.5: '"*_`–°',
        0.55: "?cszгґєз⁻", 0.61: "FPLkvxyвктухчья", 0.65: "0123456789$ESTYabdeghnopqu{}абеийлнопрГҐЕЗТУµμ«»",
        0.7: "ABCKRVXZдцАБВЄСХЧЬЯΔφ", 0.76: "HNUмИЙКЛНП", 0.8: "&DGOQДОЦ", 0.86: "#+<=>^~wфю×±ω−→≥≤", 0.91: "MжМФ",
        0.96: "%щш", 1.0: "@Wm…", 1.1: "ЖШЩЮ",
    }.items()
    for letter in letters
}  # fmt: skip
_OTHER: Final = 0.75
_BOLD: Final = 1.1
#: Colours that are variables of the pages, as a file has them.
COLOURS: Final = {
    "ink": "#14202b", "soft": "#52606d", "grid": "#dde3e8", "edge": "#7f8c98", "paper": "#ffffff",
    "accent": "#0b5cad", "look": "#c2500a", "other": NEUTRAL,
    **{f"series-{place}": colour for place, colour in enumerate(PALETTE, 1)},
}  # fmt: skip
_VARIABLES: Final = {colour: f"var(--{name})" for name, colour in COLOURS.items()}
_USED: Final = re.compile(r"var\(--([\w-]+)\)")
#: Outlines of markers of the size 1 around a point; the last ones are drawn as lines.
_SHAPES: Final = {
    "circle": (("m", -1, 0), ("a", 1, 1, 0, 1, 0, 2, 0), ("a", 1, 1, 0, 1, 0, -2, 0)),
    "square": (("m", -0.9, -0.9), ("h", 1.8), ("v", 1.8), ("h", -1.8)),
    "diamond": (("m", 0, -1.25), ("l", 1.25, 1.25, -1.25, 1.25, -1.25, -1.25)),
    "triangle-up": (("m", 0, -1.2), ("l", 1.15, 2, -2.3, 0)),
    "triangle-down": (("m", 0, 1.2), ("l", 1.15, -2, -2.3, 0)),
    "star": (("m", 0, -1.4), ("l", 0.4, 1, 1, 0.4, -1, 0.4, -0.4, 1, -0.4, -1, -1, -0.4, 1, -0.4)),
    "x": (("m", -1, -0.5), ("l", 0.5, -0.5, 0.5, 0.5, 0.5, -0.5, 0.5, 0.5, -0.5, 0.5, 0.5, 0.5, -0.5, 0.5, -0.5, -0.5,
                             -0.5, 0.5, -0.5, -0.5, 0.5, -0.5)),
    "cross": (("m", -0.4, -1.2), ("h", 0.8), ("v", 0.8), ("h", 0.8), ("v", 0.8), ("h", -0.8), ("v", 0.8), ("h", -0.8),
              ("v", -0.8), ("h", -0.8), ("v", -0.8), ("h", 0.8)),
}  # fmt: skip


def text_width(text: str, size: float = SIZE, *, bold: bool = False) -> float:
    """Pixels that a text takes at most in the usual fonts."""
    return sum(_WIDTHS.get(letter, _OTHER) for letter in text) * size * (_BOLD if bold else 1.0)


def lines_of(text: str, width: float, size: float = SIZE, *, bold: bool = False) -> list[str]:
    """A text in lines that fit a width (px), as far as its words allow."""
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and text_width(longer, size, bold=bold) > width:
            lines.append(word)
        else:
            lines[-1:] = [longer]
    return [line for line in lines if line]


def cut(text: str, width: float, size: float = SIZE) -> str:
    """A text without its end where it is wider than ``width`` (px)."""
    if text_width(text, size) <= width:
        return text
    while text and text_width(f"{text}…", size) > width:
        text = text[:-1]
    return f"{text.rstrip()}…"


def attributes(values: Mapping[str, object]) -> str:
    """Attributes of an element; those that are None are left out, and ``_`` stands for ``-``."""
    return "".join(
        f' {key.rstrip("_").replace("_", "-")}="{escape(short(value) if isinstance(value, float) else str(value))}"'
        for key, value in values.items()
        if value is not None
    )


def element(name: str, inside: str = "", **values: object) -> str:
    """An element of SVG."""
    return f"<{name}{attributes(values)}>{inside}</{name}>" if inside else f"<{name}{attributes(values)}/>"


def moved(inside: str, left: float, top: float, **values: object) -> str:
    """A group whose parts are drawn from a point on."""
    return element("g", inside, transform=f"translate({short(left)} {short(top)})", **values)


def text_at(text: str, x: float, y: float, **values: object) -> str:
    """A text whose base line begins, is centred or ends at a point (``text_anchor``)."""
    return element("text", escape(text), x=x, y=y, **values)


def halo(text: str, x: float, y: float, **values: object) -> str:
    """A text on curves: an edge in the colour of the paper keeps it readable."""
    edge = {"stroke": "var(--paper)", "stroke_width": 3, "stroke_linejoin": "round", "paint_order": "stroke"}
    return text_at(text, x, y, **edge, **values)


def short(value: float) -> str:
    """A number of pixels, to a tenth."""
    text = f"{value:.1f}"
    return text[:-2] if text.endswith(".0") else text


def colour_of(colour: str) -> str:
    """A colour of a description as pages have it: a variable where it is one of the palette."""
    return _VARIABLES.get(colour.lower(), colour)


def on_paper(svg: str) -> str:
    """The same picture with the colours of a file in the place of the variables of pages."""
    return _USED.sub(lambda found: COLOURS.get(found[1], COLOURS["ink"]), svg)


def path_of(x: Numbers, y: Numbers) -> str:
    """The path through points (px), broken where one has no number."""
    parts, joined = [], False
    for across, up in zip(x.tolist(), y.tolist(), strict=True):
        if across == across and up == up:  # noqa: PLR0124  # not a number
            parts.append(f"{'L' if joined else 'M'}{short(across)} {short(up)}")
            joined = True
        else:
            joined = False
    return "".join(parts)


def dots(x: Numbers, y: Numbers) -> str:
    """The path of many points, which round ends of lines make dots."""
    return "".join(f"M{short(across)} {short(up)}h0" for across, up in zip(x.tolist(), y.tolist(), strict=True))


def marker(shape: str, size: float) -> str:
    """The outline of a marker around the point at which a path is."""
    steps = _SHAPES.get(shape, _SHAPES["circle"])
    return "".join(_step(letter, numbers, size) for letter, *numbers in steps) + "z"


def _step(letter: str, numbers: Sequence[float], size: float) -> str:
    if letter == "a":  # its third to fifth numbers are an angle and two choices
        radii, kept, end = numbers[:2], numbers[2:5], numbers[5:]
        values: Iterable[str] = [*_scaled(radii, size), *(str(int(one)) for one in kept), *_scaled(end, size)]
    else:
        values = _scaled(numbers, size)
    return letter + " ".join(values)


def _scaled(numbers: Iterable[float], size: float) -> list[str]:
    return [f"{number * size:.2f}".rstrip("0").rstrip(".") for number in numbers]


def markers(shape: str, size: float, x: Numbers, y: Numbers) -> str:
    """The path of the same marker at several points."""
    outline = marker(shape, size)
    return "".join(f"M{short(across)} {short(up)}{outline}" for across, up in zip(x.tolist(), y.tolist(), strict=True))
