"""The colours of pages: text stands out from its ground by 4.5 : 1, edges of controls and lines of figures by 3 : 1."""

from __future__ import annotations

import re
from importlib.resources import files

import pytest

TEXTS = ("ink", "soft", "accent", "good", "warn", "bad", "look")
MARKS = ("edge", "other", "q3", "q4", "q5", *(f"series-{n}" for n in range(1, 7)))
GROUNDS = {
    "wash": TEXTS[:6],
    "accent-wash": ("ink", "accent", "soft"),
    "warn-wash": ("ink", "warn"),
    "bad-wash": ("ink", "bad"),
}


def _luminance(colour: str) -> float:
    full = colour if len(colour) == 7 else "#" + "".join(2 * digit for digit in colour[1:])
    parts = [int(full[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _contrast(one: str, other: str) -> float:
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_text_and_edges_stand_out_in_both_schemes(scheme: int) -> None:
    style = (files("sprag_study.service.http.web") / "static" / "sprag.css").read_text(encoding="utf-8")
    blocks = re.findall(r":root \{(.*?)\}", style, re.DOTALL)[:2]
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{3,6});", block)) for block in blocks)
    colours = {**light, **(dark if scheme else {})}
    weak = {
        (name, ground): round(found, 2)
        for ground, names, least in (
            ("paper", TEXTS, 4.5),
            ("paper", MARKS, 3.0),
            ("wash", ("edge",), 3.0),
            ("accent", ("on-accent",), 4.5),
            *((ground, names, 4.5) for ground, names in GROUNDS.items()),
        )
        for name in names
        if (found := _contrast(colours[name], colours[ground])) < least
    }
    assert not weak
