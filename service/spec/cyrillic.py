"""Cyrillic names of units, such as ``Н/мм`` and ``град``, and the Latin names that the rest of the program uses."""

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
    "т": "t",
    "сек": "s",
    "мин": "min",
    "ч": "h",
    "час": "h",
    "бар": "bar",
    "кгс": "kgf",
    "град": "deg",
    "об": "rev",
    "дюйм": "in",
    "фут": "ft",
    "фунт": "lb",
    **dict.fromkeys(("период", "периода", "периодов", "периоды"), "periods"),
}
_WORD: Final = re.compile("[А-Яа-яЁё]+")


def latin(text: str) -> str:
    """``text`` with the Latin names of units; words that name no unit stay as they are."""
    return text if text.isascii() else _WORD.sub(lambda found: NAMES.get(found[0], found[0]), text)
