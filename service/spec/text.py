"""Parses the text of a spec, JSON or TOML, strictly and with bounded work; every fault has its place."""

from __future__ import annotations

import json
import math
import re
import tomllib
from dataclasses import dataclass
from typing import Any, Final, Literal

from sprag_study.sentences import Sentence, plural
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_
from sprag_study.service.spec.report import Report, SpecError, join
from sprag_study.worker.limits import MAX_BODY_BYTES, MAX_DEPTH, MAX_INTEGER_DIGITS

_LONGEST_BITS: Final = math.ceil(MAX_INTEGER_DIGITS * math.log2(10))

Format = Literal["json", "toml"]

#: What Python says of a text that is no JSON.
_OF_JSON: Final = (
    N_("Expecting value"), N_("Expecting ',' delimiter"), N_("Expecting ':' delimiter"), N_("Extra data"),
    N_("Expecting property name enclosed in double quotes"), N_("Illegal trailing comma before end of object"),
    N_("Illegal trailing comma before end of array"), N_("Unterminated string starting at"),
    N_("Invalid control character at"), N_("Invalid \\escape"), N_("Invalid \\uXXXX escape"),
)  # fmt: skip

# Both patterns consume a whole string, closed or not, so that a scan visits each character once.
_JSON_TOKEN: Final = re.compile(r'"(?:[^"\\]|\\.)*+"?|[\[{]|[\]}]', re.DOTALL)
_TOML_TOKEN: Final = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|\#[^\n]*+|[\w+\-]++|[ \t]++|.",
    re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Body:
    """The text of a spec, or of another body of a request, in its format."""

    content: bytes
    format: Format = "json"

    def data(self) -> object:
        """Its plain data, as of `load_spec`; raises SpecError."""
        return load_spec(self.content, self.format)


class _Repeated(dict[str, Any]):
    """An object with repeated keys."""

    def __init__(self, pairs: list[tuple[str, Any]], repeated: list[str]) -> None:
        super().__init__(pairs)
        self.repeated = repeated


class _LongInteger:
    """An integer with too many digits to convert."""

    def __init__(self, digits: int) -> None:
        self.digits = digits


def load_spec(text: str | bytes, format: Format) -> object:
    """Parse the text of a spec into plain data.

    Parameters
    ----------
    text : str or bytes
        UTF-8, with or without a byte order mark, at most `MAX_BODY_BYTES`.
    format : "json" or "toml"

    Returns
    -------
    object
        Dictionaries, lists, texts, booleans, finite numbers and null, at most `MAX_DEPTH` deep.

    Raises
    ------
    SpecError
        If the text is too large, not UTF-8, not well-formed or too deep, or contains a repeated key, a number that is
        not finite or far outside the range of doubles, a date, or a lone surrogate.
    """
    source = _decode(text)
    data = _json(source) if format == "json" else _toml(source)
    report = Report()
    plain = _plain(data, "", 0, report)
    report.raise_if_any()
    return plain


def _decode(text: str | bytes) -> str:
    raw = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
    if len(raw) > MAX_BODY_BYTES:
        message = plural("the spec is {count} byte long", "the spec is {count} bytes long", len(raw))
        raise _fault(
            message,
            allowed=plural("at most {count} byte", "at most {count} bytes", MAX_BODY_BYTES),
        )
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise _fault(Sentence("the spec is not UTF-8 text: byte {place} is wrong", place=str(error.start))) from None


def _fault(message: Sentence, allowed: str | None = None) -> SpecError:
    return SpecError([Fault("", "unreadable", message, allowed=allowed)])


def _too_deep() -> SpecError:
    return _fault(
        Sentence("lists and objects are nested too deeply"),
        plural("at most {count} level", "at most {count} levels", MAX_DEPTH),
    )


def _json(source: str) -> object:
    depth = 0
    for match in _JSON_TOKEN.finditer(source):
        depth += {"[": 1, "{": 1, "]": -1, "}": -1}.get(match[0], 0)
        if depth > MAX_DEPTH:
            raise _too_deep()
    try:
        return json.loads(source, object_pairs_hook=_pairs, parse_int=_integer)
    except json.JSONDecodeError as error:
        place = {"line": str(error.lineno), "column": str(error.colno)}
        message = Sentence("not JSON: {error} in line {line}, column {column}", error=Sentence(error.msg), **place)
        raise _fault(message) from None


def _pairs(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    seen: set[str] = set()
    return _Repeated(pairs, [key for key, _ in pairs if key in seen or seen.add(key)])  # type: ignore[func-returns-value]


def _integer(digits: str) -> int | _LongInteger:
    # Conversion takes quadratic time, and Python refuses more than a few thousand digits.
    return int(digits) if len(digits) <= MAX_INTEGER_DIGITS else _LongInteger(len(digits.lstrip("-")))


def _toml(source: str) -> object:
    _check_toml_depth(source)
    try:
        return tomllib.loads(source)
    except tomllib.TOMLDecodeError as error:
        raise _fault(Sentence("not TOML: {error}", error=str(error)[:200])) from None
    except ValueError:
        # The TOML grammar accepts numbers and dates that Python does not.
        raise _fault(Sentence("not TOML that can be read: a number or a date is out of range")) from None
    except RecursionError:
        raise _too_deep() from None


def _check_toml_depth(source: str) -> None:
    """Refuse deep brackets and long dotted keys, for which the parser takes quadratic time."""
    depth = dots = 0
    after_dot = False
    for match in _TOML_TOKEN.finditer(source):
        token = match[0]
        if token == ".":  # noqa: S105
            dots, after_dot = dots + 1, True
        elif token[0] in " \t":
            continue
        elif token[0] in "[{":
            depth, dots = depth + 1, 0
        elif token[0] in "]}":
            depth, dots = depth - 1, 0
        else:
            dots, after_dot = dots if after_dot else 0, False
        if max(depth, dots) > MAX_DEPTH:
            raise _too_deep()


def _plain(data: object, pointer: str, depth: int, report: Report) -> object:
    """``data`` as plain data; anything else is recorded as a fault."""
    if isinstance(data, dict | list):
        if depth >= MAX_DEPTH:
            raise _too_deep()
        return _plain_container(data, pointer, depth, report)
    if isinstance(data, str):
        if _halved(data):
            report.fault(pointer, "invalid-text", "the text contains half a character (a lone surrogate)", data)
    elif isinstance(data, int):
        if data.bit_length() > _LONGEST_BITS:
            report.fault(pointer, "out-of-range", "is too large for a number", data)
    elif isinstance(data, _LongInteger):
        report.fault(pointer, "out-of-range", "is too large for a number", f"an integer of {data.digits} digits")
    elif isinstance(data, float):
        if not math.isfinite(data):
            report.fault(pointer, "not-finite", "must be a finite number (not NaN, Infinity or an overflow)", data)
    elif data is not None:
        report.fault(pointer, "wrong-type", "is a date or a time; no field of a spec takes one", str(data))
    return data


def _plain_container(data: dict[str, Any] | list[Any], pointer: str, depth: int, report: Report) -> object:
    if isinstance(data, list):
        return [_plain(item, f"{pointer}/{index}", depth + 1, report) for index, item in enumerate(data)]
    if isinstance(data, _Repeated):
        for key in data.repeated:
            report.fault(join(pointer, key), "repeated", "this field is given more than once")
    for key in data:
        if _halved(key):
            report.fault(
                join(pointer, key), "invalid-text", "the field's name contains half a character (a lone surrogate)"
            )
    return {key: _plain(item, join(pointer, key), depth + 1, report) for key, item in data.items()}


def _halved(text: str) -> bool:
    return not text.isascii() and any("\ud800" <= character <= "\udfff" for character in text)
