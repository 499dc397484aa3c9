"""Cyrillic names of units, such as ``Н/мм`` and ``об/хв``, and the Latin names that the rest of the program uses.

They are Ukrainian and Russian.
"""

from __future__ import annotations

import re
from typing import Final

_PREFIXES: Final = {"": "", "н": "n", "мк": "u", "м": "m", "с": "c", "д": "d", "к": "k", "М": "M", "Г": "G"}
_WITH_PREFIX: Final = {
    "м": "m",
    "г": "g",
    "с": "s",
    "рад": "rad",
    "Гц": "Hz",
    "Н": "N",
    "Дж": "J",
    "Вт": "W",
    "Па": "Pa",
    # Torques are often written without the multiplication sign.
    "Нм": "Nm",
    "Нсм": "Ncm",
    "Нмм": "Nmm",
    "Нмс": "Nms",
}
#: Every Cyrillic name of a unit, and the Latin one.
NAMES: Final = {
    **{prefix + name: latin + unit for prefix, latin in _PREFIXES.items() for name, unit in _WITH_PREFIX.items()},
    **dict.fromkeys(("гц", "герц", "Герц"), "Hz"),
    "т": "t",
    "сек": "s",
    **dict.fromkeys(("мин", "хв"), "min"),
    **dict.fromkeys(("ч", "час", "год"), "h"),
    "бар": "bar",
    "кгс": "kgf",
    "град": "deg",
    "гон": "gon",
    **dict.fromkeys(("об", "оберт", "оберти", "обертів", "оборот", "оборота", "оборотов"), "rev"),
    "атм": "atm",
    **dict.fromkeys(("к.с", "л.с"), "PS"),
    # Moments of inertia without the multiplication sign; the power stands behind.
    **{
        f"{gram}{length}": f"{latin_gram}{latin_length}"
        for gram, latin_gram in (("кг", "kg"), ("г", "g"))
        for length, latin_length in (("м", "m"), ("мм", "mm"))
    },
    "гсм": "gcm",  # but "кгсм" is either kg*cm or kgf*m
    "дюйм": "in",
    "фут": "ft",
    "фунт": "lb",
    **dict.fromkeys(("фунт-сил", "фунт-сила", "фунт-сили"), "lbf"),
    **dict.fromkeys(
        ("период", "периода", "периодов", "периоды", "період", "періоду", "періодів", "періоди"), "periods"
    ),
}
#: Words, the pound-force, which has a hyphen, and the metric horsepower, which has points.
_WORD: Final = re.compile(r"фунт-сил[аиі]?|[кл]\.\s?с(?![А-Яа-яЁёІіЇїЄєҐґ])\.?|[А-Яа-яЁёІіЇїЄєҐґ]+")


def latin(text: str) -> str:
    """``text`` with the Latin names of units; words that name no unit stay as they are."""
    return text if text.isascii() else _WORD.sub(_latin_name, text)


def _latin_name(found: re.Match[str]) -> str:
    return NAMES.get("".join(found[0].split()).rstrip("."), found[0])
