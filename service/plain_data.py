"""Values of Python programs as plain JSON data: numbers of numpy and decimal, arrays, columns and quantities of pint.

Libraries are recognized by what their objects offer, so that none of them has to be installed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from decimal import Decimal
from numbers import Integral, Rational, Real
from typing import Any, Final

from sprag_study.service.faults import Code, Fault

#: Deeper data are refused, as those of a list that contains itself.
_MOST_DEEP: Final = 100
_MOST_FAULTS: Final = 20
#: Whole numbers below are doubles too.
_EXACT: Final = 2.0**53
_ALLOWED: Final = "texts, numbers, true, false, None, lists, arrays, mappings, quantities of pint"


def plain(data: object) -> tuple[Any, list[Fault]]:
    """``data`` as dictionaries, lists, texts, finite numbers, booleans and None, and what in it is none of these.

    Whole numbers stay whole, others become the nearest double; a quantity of pint becomes a text with its unit, one of
    an array a list of texts. Faults have the JSON Pointer of the value; there are at most 20.
    """
    reader = _Reader()
    return reader.read(data, "", 0), reader.faults


class _Reader:
    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def read(self, data: Any, pointer: str, depth: int) -> Any:
        if data is None or isinstance(data, bool):
            return data
        if isinstance(data, str):
            return data if type(data) is str else str.__str__(data)
        if isinstance(data, Decimal | Real):
            return self._number(data, pointer)
        if depth >= _MOST_DEEP:
            return self._fault(pointer, "too-long", "lists and objects are nested too deeply", None)
        if isinstance(data, Mapping):
            return {
                self._key(key, pointer): self.read(item, f"{pointer}/{_escaped(key)}", depth + 1)
                for key, item in data.items()
            }
        if isinstance(data, Sequence) and not isinstance(data, bytes | bytearray | memoryview):
            return [self.read(item, f"{pointer}/{index}", depth + 1) for index, item in enumerate(data)]
        kind = type(data)
        if hasattr(kind, "magnitude") and hasattr(kind, "units"):
            return self._quantity(data, pointer, depth)
        if hasattr(kind, "dims") and hasattr(kind, "data"):  # an array of xarray, with the unit of its attributes
            unit = str(data.attrs.get("units", ""))
            values = self.read(data.data, pointer, depth + 1)
            return values if values is None or unit in ("", "1") else _with_unit(values, unit)
        listed = getattr(kind, "tolist", getattr(kind, "to_list", None))
        # Other libraries of units give their lists without the units.
        if listed is None or hasattr(kind, "unit") or hasattr(kind, "units"):
            return self._refused(data, pointer)
        items = listed(data)
        return self._refused(data, pointer) if type(items) is kind else self.read(items, pointer, depth + 1)

    def _number(self, data: Any, pointer: str) -> Any:
        if isinstance(data, Integral):
            return int(data)
        try:
            number = float(data)
        except OverflowError:
            number = math.inf
        finite = data.is_finite() if isinstance(data, Decimal) else isinstance(data, Rational) or math.isfinite(number)
        if not finite:
            return self._fault(pointer, "not-finite", "must be a finite number", str(data))
        if math.isinf(number) or (number == 0.0 and data != 0):
            size = "large for a number" if number else "small for a number but not 0"
            return self._fault(pointer, "out-of-range", f"is too {size}", str(data)[:40])
        # Whole decimals and fractions are whole numbers, which some fields need.
        whole = isinstance(data, Decimal | Rational) and abs(number) < _EXACT and number.is_integer() and data == number
        return int(number) if whole else number

    def _quantity(self, data: Any, pointer: str, depth: int) -> Any:
        number = self.read(data.magnitude, pointer, depth + 1)
        unit = format(data.units, "~D")
        return number if number is None or not unit else _with_unit(number, unit)

    def _key(self, key: object, pointer: str) -> str:
        if isinstance(key, str):
            return str(key)
        if isinstance(key, Integral):
            return str(int(key))
        self._fault(pointer, "wrong-type", "has a key that is no text", str(key)[:40], "texts as keys")
        return str(key)

    def _refused(self, data: object, pointer: str) -> Any:
        name = f"{type(data).__module__}.{type(data).__qualname__}".removeprefix("builtins.")
        return self._fault(pointer, "wrong-type", f"is a value of Python that no spec has ({name})", None, _ALLOWED)

    def _fault(self, pointer: str, code: Code, message: str, value: object, allowed: str | None = None) -> Any:
        """Record a fault; the value None in its place."""
        if len(self.faults) < _MOST_FAULTS:
            self.faults.append(Fault(pointer, code, message, value, allowed))
        return None


def _with_unit(number: Any, unit: str) -> Any:
    if isinstance(number, list):
        return [_with_unit(item, unit) for item in number]
    return number if isinstance(number, str) or number is None else f"{number!r} {unit}"


def _escaped(key: object) -> str:
    return str(key).replace("~", "~0").replace("/", "~1")
