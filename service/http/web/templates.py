"""The templates of the pages, and the display of numbers, units and names on them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any, Final
from urllib.parse import urlencode

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, pass_context
from jinja2.ext import Extension
from jinja2.runtime import Context
from markupsafe import Markup, escape
from starlette.responses import Response

from sprag_study.sentences import Sentence, WarningText
from sprag_study.service import languages
from sprag_study.service.actor import Role
from sprag_study.service.http.current import current
from sprag_study.service.http.prefix import here
from sprag_study.service.http.reading import file_read_as
from sprag_study.service.http.web.explained import explained
from sprag_study.service.http.web.script_texts import translated_texts
from sprag_study.service.languages import N_
from sprag_study.service.reading import times
from sprag_study.service.reading.faults import allowed_text, fault_text, value_text
from sprag_study.service.reading.quantities import KINDS, SI, TYPED, WORKSHOP, read_units
from sprag_study.service.reading.reader import CLUTCH, Reading, model_title, shown, shown_stored, titled, word
from sprag_study.service.reading.wording import counted, duration, number, symbol, typed_text, unit_text
from sprag_study.service.report.html import embedded, sheet_of
from sprag_study.worker import models

#: The beginning of an attribute that is an address: a path of this service, or an expression that may give one.
_ADDRESS = re.compile(
    r"""(?<=\s)(?P<name>href|src|action|formaction|data-(?:address|along|check|engagements|events|figure|front|live|motion))="
    (?:(?P<path>/(?!/))|\{\{(?P<expression>.*?)\}\})""",
    re.VERBOSE,
)


#: A text of the catalogues, whose addresses are completed when it is shown.
_TRANSLATED: Final = re.compile(r"(\{%-? *trans\b.*?\{%-? *endtrans *-?%\})", re.DOTALL)


class Addresses(Extension):
    """Adds the URL prefix of the service (`sprag_study.service.http.prefix`) to every address in a page."""

    def preprocess(self, source: str, name: str | None, filename: str | None = None) -> str:  # noqa: ARG002
        """The template with ``here`` where an address begins."""

        def completed(match: re.Match[str]) -> str:
            inside = "here('/')" if match["path"] else f"({match['expression']}) | here"
            return f'{match["name"]}="{{{{ {inside} }}}}'

        pieces = _TRANSLATED.split(source)
        pieces[::2] = [_ADDRESS.sub(completed, piece) for piece in pieces[::2]]
        return "".join(pieces)


def _with_prefix(text: str) -> str:
    """A text of the catalogues with complete addresses."""
    return _ADDRESS.sub(lambda match: f'{match["name"]}="{here("/")}', text) if '="/' in text else text


def _text(message: str) -> str:
    return _with_prefix(languages.gettext(message))


def _plain_text(message: str, **values: object) -> str:
    """`_` of templates: text, which the page escapes; texts with tags are in ``{% trans %}``."""
    text = languages.gettext(message)
    return text % values if values else text


def _text_of(one: str, many: str, number: float) -> str:
    return _with_prefix(languages.ngettext(one, many, number))


def _read(value: object) -> object:
    """What a page writes: phrases in the reader's language, anything else as it is.

    A warning needs a reading: a template writes it by the filter ``warning``.
    """
    if isinstance(value, WarningText):
        raise TypeError("a warning is written by the filter `warning`")
    return shown(value) if isinstance(value, Sentence) else value


def _when_shown(write: Callable[[Any], str]) -> Callable[[Context, Any], str]:
    """A filter whose constants are written when a page is, not once for all languages when its template is read."""

    @pass_context
    def written(_context: Context, value: Any) -> str:
        return write(value)

    return written


def _warning(text: str, reading: Reading) -> str:
    return reading.warning(text)


@lru_cache(maxsize=1)
def _templates() -> Environment:
    environment = Environment(
        # The sheets of a document are those of its files.
        loader=ChoiceLoader(
            [PackageLoader("sprag_study.service.http.web"), PackageLoader("sprag_study.service.report")]
        ),
        autoescape=True,
        extensions=[Addresses, "jinja2.ext.i18n"],
        undefined=StrictUndefined,
        finalize=_read,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.policies["ext.i18n.trimmed"] = True
    # What the extension for texts adds.
    environment.install_gettext_callables(_text, _text_of, newstyle=True, pgettext=languages.pgettext)  # type: ignore[attr-defined]
    environment.globals["_"] = _plain_text
    environment.filters |= {
        "number": cell,
        "counted": counted,
        "typed": _when_shown(typed_text),
        "unit": _when_shown(unit_text),
        "spec": spec_text,
        "marked": marked,
        "symbol": symbol,
        "words": titled,
        "word": word,
        "text": languages.gettext,
        "recorded": shown_stored,
        "say": shown,
        "fault": fault_text,
        "warning": _warning,
        "allowed": allowed_text,
        "given": value_text,
        "model": model_title,
        "moment": moment,
        "moment_in_full": moment_in_full,
        "duration": duration,
        "time_left": time_left,
        "bytes": bytes_text,
        "query": urlencode,
        "here": here,
        "embedded": embedded,
    }
    environment.globals["sheet_of"] = sheet_of
    environment.globals["here"] = here
    environment.globals["prefix_of_urls"] = lambda: current().prefix
    environment.globals["language"] = languages.current
    environment.globals["languages"] = languages.titles
    environment.globals["file_read_as"] = file_read_as
    environment.globals["script_texts"] = translated_texts
    environment.globals["page_address"] = lambda: current().page
    environment.globals["read_only"] = _read_only
    environment.globals["units_back"] = _units_back
    environment.globals["part_of_pages"] = _part
    environment.globals["units_shown"] = _units_shown
    environment.globals["units_of_address"] = lambda: (
        "" if current().choice.units == current().usual else current().choice.units
    )
    environment.globals["zone"] = lambda: current().zone
    environment.globals["zone_of_browser"] = lambda: "" if current().chosen_zone else current().zone
    environment.globals["reader_name"] = _reader_name
    environment.globals["explained"] = explained
    environment.globals["clutch_reading"] = CLUTCH
    return environment


def cell(value: float | str | None, digits: int = 5) -> str:
    """`number` with the words of a category: ``unsettled`` in the reader's language."""
    return word(value) if isinstance(value, str) else number(value, digits)


#: Kinds of quantities whose units the head of a page names, and what they are in a workshop.
_NAMED_KINDS: Final = ("speed", "length", "torque", "share")
_WORKSHOP: Final = {"rad/s": "rpm", "m": "mm", "N*m": "N*m", models.SHARE: "%"}

#: Which part of the pages an address belongs to, for the head of the page; studies are the rest.
_PARTS: Final = {
    "parts": "parts",
    "nights": "nights",
    "help": "help",
    "problems": "help",
    "login": "me",
    "me": "me",
}


def _part() -> str:
    """The part of the pages that the page which is made belongs to."""
    first = re.split(r"[/?]", current().page.lstrip("/"), maxsplit=1)[0]
    return _PARTS.get(first, "studies")


def _units_back() -> str:
    """The way back from the page of units to the page that is made, for its address."""
    return f"?{urlencode({'back': current().page})}" if current().page not in {"", "/"} else ""


def _units_shown() -> str:
    """The units of the page in a few words: ``rpm · mm · N·m · %``."""
    rest, chosen = read_units(current().choice.units)
    if rest == TYPED and not chosen:
        return languages.gettext("as typed")
    if rest == SI and not chosen:
        return "SI"
    others = {**(_WORKSHOP if rest == WORKSHOP else {}), **chosen}
    units = (others.get(kind.unit, "") for kind in KINDS if kind.name in _NAMED_KINDS)
    return " · ".join(unit_text(unit) for unit in units if unit) or languages.gettext("own units")


def _read_only() -> str:
    """Who asks for the page, where that is a viewer; "" for anybody who may change something."""
    grant = current().grant
    return grant.label if grant is not None and grant.role is Role.VIEWER else ""


def _reader_name() -> str:
    """The name of the user who asks for the page; "" for a token without one."""
    grant = current().grant
    return (grant.user or "") if grant is not None else ""


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


def moment(given: str | datetime | None, *, seconds: bool = False) -> Markup:
    """A time for the reader, ``today 11:14``, or to the second, with all of it as its title."""
    if not given:
        return Markup("–")
    at, zone = datetime.fromisoformat(given) if isinstance(given, str) else given, current().zone
    short, full = times.when(at, datetime.now(UTC), zone, seconds=seconds), times.in_full(at, zone)
    return Markup('<time datetime="{}" title="{}">{}</time>').format(at.isoformat(timespec="seconds"), full, short)


def moment_in_full(text: str) -> str:
    """A time stamp to the second in the reader's zone, for paper."""
    return times.in_full(datetime.fromisoformat(text), current().zone)


def time_left(seconds: Mapping[str, float]) -> str:
    """The bounds of the time left, or a single value where both read the same."""
    low, high = duration(seconds["low"]), duration(seconds["high"])
    return low if low == high else languages.gettext("{low} to {high}", low=low, high=high)


def bytes_text(count: float) -> str:
    """A size of a file: ``12 kB``, ``3.4 MB``."""
    for divisor, unit in ((1e9, N_("GB")), (1e6, N_("MB")), (1e3, N_("kB"))):
        if count >= divisor:
            rounded = float(f"{count / divisor:.2g}")
            return f"{languages.decimal(f'{rounded:g}')} {languages.gettext(unit)}"
    return languages.gettext("{n} B", n=f"{count:.0f}")
