"""Every text of every page is in the catalogues: in a made-up language all are in brackets."""

from __future__ import annotations

import html
import json
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import pytest

from sprag_study.service import languages
from sprag_study.service.http.web import manual
from sprag_study.service.languages.catalogue import Catalogue, Entry, Key
from sprag_study.service.spec.described import ANY_RUN, SETTLED_RUN
from sprag_study.service.spec.machine.shaft_parts import MECHANISM_CHOICES, OPERATION_CHOICES
from sprag_study.worker.models import ENDING_SENTENCES, REGIME_SENTENCES
from sprag_study.worker.models.registry import all_models
from tests.service.http.web.test_accessibility import LONG, PAGES, studies

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from tests.service.conftest import Service

MADE_UP = "qq"
#: Elements whose text is code, data or in a language of its own.
_CODE = {"code", "pre", "script", "style", "kbd", "i", "sub", "textarea"}
#: Elements that have no end.
_EMPTY = {"meta", "link", "input", "img", "br", "col", "hr", "path", "circle", "line", "rect", "polyline"}
_ATTRIBUTES = ("title", "aria-label", "placeholder", "alt")
_WORD = re.compile(r"[A-Za-z]{3,}")
_PLACE = re.compile(r"%\(\w+\)s|\{\w+[^{}]*\}")
#: A name that does not fit in a figure is cut.
_BRACKETS = re.compile(r"⟦[^⟦⟧]*⟧|⟦[^⟦⟧\x01]*…(?=\x01|$)")
#: Names, formats, units and code names, which are the same in all languages.
_SAME = re.compile(
    r"\b(Sprag|API|UTC|csv|json|svg|png|pdf|html|xlsx|netcdf|parquet|arrow|jsonl|curl|JSON|TOML|CSV|PDF|HTML|SVG|PNG|"
    r"English|Українська|JavaScript|rpm|deg|min|rad|lbf|bar|kPa|MPa|cos|πft|sin|"
    r"[a-z_][a-z_0-9]*(\.\w+)+|[sv][ctw]_[0-9a-f]{16}|[0-9a-f]{12}|[0-9a-f]{64}|[A-Z]\w+(/[A-Z]\w+)+)\b|\[[^\[\]]*\]|,sigma$|"
    r"; efficiency$|\bT_(mean|min)\b"
)
#: Code names in one word, which a title has beside the caption of an element.
_CHOICES = {"slider_crank", "force", "angle", "steps", "constant", "midrange", "resisting", "none"}
_CHOSEN = {
    *("cycle", "mean_speed_is", "balance", "balance_side", "phi_c", "drive.motor.kind"),
    *("drive.flywheel.kind", "drive.flywheel.shaft"),
    *("drive.stages", "mechanism", "operation"),
    *(f"operation.{name}" for name in (*OPERATION_CHOICES, "efficiency_is")),
    *(f"mechanism.{kind}.{name}" for kind, own in MECHANISM_CHOICES.items() for name in own),
    *(f"mechanism.linkage.{name}" for name in ("elements", "working", "forward")),
    *(f"{part}.interpolation" for part in ("drive.torque", "mechanism", "operation")),
}
_NAMES = {*_CHOSEN, *SETTLED_RUN, *ANY_RUN, *ENDING_SENTENCES, *_CHOICES, "duration", "window", "drive"}
for _model in all_models():
    _NAMES |= {_model.name, *_model.flags}
    _NAMES |= {*(entry.path for entry in _model.parameters()), *(info.name for info in _model.result_catalogue())}


class Texts(HTMLParser):
    """Visible texts of a page, with those of attributes that people read or hear."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.attributes: list[str] = []
        self.body: list[str] = []
        self._outside: list[bool] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        other = tag in _CODE or (given.get("lang") not in (None, MADE_UP)) or given.get("translate") == "no"
        if not other:
            known = {name: value for name in _ATTRIBUTES if (value := given.get(name))}
            if re.fullmatch(r"\d+ periods", known.get("placeholder", "")):  # as it is typed
                del known["placeholder"]
            found = (value.partition(": ") for value in known.values())
            self.attributes += [rest if first in _NAMES else f"{first}{colon}{rest}" for first, colon, rest in found]
        if tag not in _EMPTY:
            self._outside.append(other)

    def handle_endtag(self, tag: str) -> None:
        if tag not in _EMPTY and self._outside:
            self._outside.pop()

    def handle_data(self, data: str) -> None:
        if not any(self._outside):
            self.body.append(data)


def rest_of(part: str) -> bool:
    """Whether there is a word that is not the same in all languages."""
    return bool(_WORD.search(_SAME.sub("", part)))


def around(text: str) -> str:
    """A text in brackets, its places outside them: what is put there has to be in brackets itself."""
    return f"⟦{_PLACE.sub(lambda place: f'⟧{place[0]}⟦', text)}⟧"


@pytest.fixture
def bracketed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A language in which each text of the catalogues is in brackets, whose inside may hold bracketed texts, too."""
    keep = {"decimal mark", "date"}
    # The check of the catalogues sees to it that each of them has every text.
    known_texts = {key: entry.many for key, entry in languages.catalogue("uk").entries.items()}
    entries = {
        key: Entry((key.text if key.context in keep or not _WORD.search(key.text) else around(key.text),) * count, many)
        for key, many in known_texts.items()
        for count in [2 if many else 1]
    }
    entries |= {key: Entry((around(key.text), around(many)), many) for key, many in known_texts.items() if many}
    entries[Key("English", "name of this language")] = Entry(("Bracketed",))
    made_up = Catalogue("Plural-Forms: nplurals=2; plural=(n != 1);\n", entries)
    real, known = languages.catalogue, languages.available()
    monkeypatch.setattr(languages, "catalogue", lambda code: made_up if code == MADE_UP else real(code))
    monkeypatch.setattr(languages, "available", lambda: (*known, MADE_UP))
    languages.titles.cache_clear()
    yield
    languages.titles.cache_clear()


def written(figure: str) -> Iterator[str]:
    """The texts that people read in a part of a page with a figure."""
    yield from re.findall(r">([^<>]+)<", figure)


def bare(text: str, names: Iterable[str]) -> str:
    """A text without what is in brackets and without ``names``."""
    while text != (text := _BRACKETS.sub("", text)):
        pass
    for name in names:
        text = text.replace(name, "")
    return text


def left(page: str, names: Iterable[str] = ()) -> list[str]:
    """What stands on a page outside all brackets and is not the same in all languages, nor one of ``names``."""
    texts_of = Texts(page)
    longest_first = sorted(names, key=len, reverse=True)
    given = re.compile("|".join(rf"(?<!\w ){re.escape(name)}(?! \w)" for name in longest_first) or "(?!)")
    # Brackets go around the tags within a text.
    pieces = [*texts_of.attributes, "\x01".join(texts_of.body)]
    found = []
    for text in pieces:
        while text != (text := _BRACKETS.sub("\x02", text)):
            pass
        parts = (given.sub("", part) for part in text.split("\x01"))
        found += [" ".join(part.replace("\x02", " ").split()) for part in parts if rest_of(part)]
    return found


def without_given(report: str) -> str:
    """A report without the table of what was given, which is in the words of its author."""
    return "".join(part for part in re.split("(?=<table)|(?<=</table>)", report) if "⟦As given⟧" not in part)


@pytest.mark.usefixtures("bracketed")
def test_no_text_of_any_page_is_left_out(service: Service) -> None:
    ids = studies(service)
    own = {study["name"] for study in service.get("/studies")["studies"]}
    categories = ", ".join(REGIME_SENTENCES)
    names = {
        LONG,
        "Nothing",
        "nothing",  # what was searched for
        "'none'",
        "test",
        "efficiency",
        "Bracketed",  # languages have their own names
        categories,
        *own,
        *(f"{name}, design of case 0" for name in own),
        *manual.titles().values(),
    }
    found: dict[str, list[str]] = {}
    for address in (address.format(**ids) for addresses in PAGES.values() for address in addresses):
        headers = {"Accept": "text/html", "Accept-Language": MADE_UP}
        answer = service.http.get(address, headers=headers, follow_redirects=True)
        assert "⟦" in answer.text, address
        if texts_left := left(answer.text, names):
            found[address] = texts_left
        # Figures are drawn of texts that no page has.
        for figure in re.findall(r'data-figure="([^"]+)"', answer.text):
            made = service.http.get(html.unescape(figure), headers=headers)
            if texts_left := [text for text in written(made.text) if rest_of(bare(text, names))]:
                found[figure] = texts_left
        # What is drawn of the API is in the language of the page, too.
        drawn = re.findall(r'"(/api/v1/[^"]*format=(?:svg|png|pdf)[^"]*)"', answer.text)
        assert all(f"language={MADE_UP}" in picture for picture in drawn), (address, drawn)
    for name in ("STUDY", "SHAFT", "GOAL", "CALIBRATION", "DRIVES"):
        address = f"/api/v1/studies/{ids[name]}/report"
        answer = service.http.get(address, params={"format": "html", "language": MADE_UP, "appendix": "all"})
        assert "⟦" in answer.text, address
        if texts_left := left(without_given(answer.text), names):
            found[f"{address} ({name})"] = texts_left
    assert json.dumps(found, indent=1, ensure_ascii=False) == "{}"


def test_a_text_without_a_translation_is_found() -> None:
    assert left("<p>⟦Known ⟦within⟧⟧ 12 mm <code>code</code> Sprag</p>") == []
    assert left('<p title="Unknown">⟦Known⟧</p>') == ["Unknown"]
    assert left("<p>⟦Known⟧, unknown</p>") == [", unknown"]
