"""The templates of the pages, and the display of numbers, units and names on them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any
from urllib.parse import urlencode

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from starlette.responses import Response

from sprag.service.http.access import ASKING
from sprag.service.results.wording import counted, number, symbol, unit_text, words
from sprag.service.storage.scopes import TokenScope


@lru_cache(maxsize=1)
def _templates() -> Environment:
    environment = Environment(
        loader=PackageLoader("sprag.service.http.web"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "number": number,
        "counted": counted,
        "unit": unit_text,
        "spec": spec_text,
        "marked": marked,
        "symbol": symbol,
        "words": words,
        "moment": moment,
        "duration": duration,
        "time_left": time_left,
        "bytes": bytes_text,
        "query": urlencode,
    }
    environment.globals["read_only"] = _read_only
    return environment


def _read_only() -> str:
    """Name of the token for which the page is made, where it is read-only; "" where it allows everything."""
    grant = ASKING.get()
    return "" if grant is None or grant.scope is TokenScope.WRITE else grant.name or grant.id


def page(name: str, status: int = 200, **values: Any) -> Response:
    """The page that the template ``name`` makes of ``values``."""
    text = _templates().get_template(name).render(**values)
    return Response(text, status_code=status, media_type="text/html")


def fragment(name: str, **values: Any) -> Markup:
    """A part of a page as text, with its values escaped."""
    return Markup(_templates().get_template(name).render(**values))  # noqa: S704


def spec_text(spec: dict[str, Any]) -> str:
    """A spec as it was given: keys in order, characters unescaped; the page escapes it as a whole."""
    return json.dumps(spec, ensure_ascii=False, indent=2)


def marked(text: str) -> Markup:
    """A sentence of the documentation; text between backticks is code."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(escape(text))))  # noqa: S704 - escaped just before


def moment(text: str | None) -> str:
    """A time stamp to the second."""
    return text[:19].replace("T", " ") + " UTC" if text else "–"


def duration(seconds: float) -> str:
    """A rough duration in a suitable unit, two digits: ``40 s``, ``3 min``, ``2.5 h``."""
    if seconds < 1.0:
        return "less than 1 s"
    for limit, divisor, unit in ((100.0, 1.0, "s"), (6000.0, 60.0, "min"), (172800.0, 3600.0, "h")):
        if seconds < limit:
            return f"{float(f'{seconds / divisor:.2g}'):g} {unit}"
    return f"{float(f'{seconds / 86400.0:.2g}'):g} days"


def time_left(seconds: Mapping[str, float]) -> str:
    """The bounds of the time left, or a single value where both read the same."""
    low, high = duration(seconds["low"]), duration(seconds["high"])
    return low if low == high else f"{low} to {high}"


def bytes_text(count: float) -> str:
    """A size of a file: ``12 kB``, ``3.4 MB``."""
    for divisor, unit in ((1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= divisor:
            return f"{float(f'{count / divisor:.2g}'):g} {unit}"
    return f"{count:.0f} B"
