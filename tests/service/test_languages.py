"""Catalogues of languages: their files, plural forms, numbers and dates as CLDR has them."""

from __future__ import annotations

import re
import threading
from contextvars import copy_context
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from babel import Locale
from babel.messages.pofile import read_po
from babel.numbers import format_decimal

from docs import catalogues
from sprag_study.service import languages
from sprag_study.service.languages.catalogue import CatalogueError, Entry, Key, read, written
from sprag_study.service.reading.wording import number

if TYPE_CHECKING:
    from collections.abc import Iterable

OTHERS = [code for code in languages.available() if code != languages.ENGLISH]
#: Texts that are typed as they stand, in every language.
TYPED = {'"adaptive": ["{first}", "{last}"]', "--axis shaft.load=0.5,0.7", "cron", "identity", "programs, plain"}
HEADER = "Plural-Forms: nplurals=2; plural=(n != 1);\n"


def catalogue_of(tmp_path: Path, *lines: str) -> Path:
    file = tmp_path / "xx.po"
    file.write_text("\n".join(['msgid ""', f'msgstr "{HEADER.strip()}\\n"', *lines]), encoding="utf-8")
    return file


@pytest.mark.parametrize("code", OTHERS)
def test_no_text_stays_english(code: str) -> None:
    """That none is missing or superfluous is what ``python -m docs.catalogues --check`` holds, in `make check`."""
    same = {key.text for key, entry in languages.catalogue(code).entries.items() if key.text in entry.forms}
    assert {text for text in same if re.search(r"[a-z]{3,}", re.sub(r"\{\w+\}|%\(\w+\)s", "", text))} == TYPED


@pytest.mark.parametrize("code", OTHERS)
def test_a_catalogue_is_a_file_of_gettext(code: str) -> None:
    with (languages.FOLDER / f"{code}.po").open("rb") as file:
        known = read_po(file, code)
    ours = languages.catalogue(code)
    texts: dict[Key, Iterable[str]] = {}
    for message in known:
        if message.id:
            one = message.id if isinstance(message.id, str) else message.id[0]
            forms = (message.string,) if isinstance(message.string, str) else message.string
            texts[Key(one, message.context or "")] = tuple(forms)
    assert texts == {key: entry.forms for key, entry in ours.entries.items()}
    assert len(texts) > 20
    assert known.num_plurals == ours.plural_forms


@pytest.mark.parametrize("code", OTHERS)
def test_plurals_numbers_and_dates_are_those_of_cldr(code: str) -> None:
    locale = Locale.parse(code)
    ours = languages.catalogue(code)
    names = {count: locale.plural_form(count) for count in range(1, 1200)}
    forms = {count: ours.form_of(count) for count in names}
    assert (
        len(set(zip(names.values(), forms.values(), strict=True)))
        == len(set(names.values()))
        == len(set(forms.values()))
    )
    with languages.language(code):
        assert number(0.125) == format_decimal(0.125, locale=locale)
        day, month = locale.date_formats["short"].pattern.index("d"), locale.date_formats["short"].pattern.index("M")
        ours_of = languages.date_format()
        assert (ours_of.index("%d") < ours_of.index("%m")) == (day < month)
        assert languages.titles()[code].lower() == str(locale.get_language_name(code)).lower()


def test_english_is_what_stands_in_the_code() -> None:
    assert languages.current() == "en"
    assert languages.gettext("Close {braces}") == "Close {braces}"
    assert languages.gettext("{n} of {all}", n=1, all=2) == "1 of 2"
    assert [languages.ngettext("{n} case", "{n} cases", n, n=n) for n in (1, 2)] == ["1 case", "2 cases"]
    assert (languages.decimal("0.5"), languages.date_format()) == ("0.5", "%Y-%m-%d")


def test_a_language_ends_with_its_block_and_stays_in_its_task() -> None:
    with languages.language("uk"):
        assert (languages.gettext("Close"), number(1234.5, 6), number(1.5e-7)) == ("Закрити", "1234,5", "1,5·10⁻⁷")
        seen: list[str] = []
        for run in (lambda: seen.append(languages.current()), copy_context().run):
            thread = threading.Thread(target=run, args=(lambda: seen.append(languages.current()),) if seen else ())
            thread.start()
            thread.join()
        assert seen == ["en", "uk"]
    assert languages.gettext("Close") == "Close"
    with languages.language("tlh"):
        assert languages.current() == "en"


def test_forms_of_numbers(tmp_path: Path) -> None:
    rule = languages.catalogue("uk")
    entries = {Key("{n} case"): Entry(("{n} випадок", "{n} випадки", "{n} випадків"), "{n} cases")}
    ukrainian = type(rule)(rule.header, entries)
    said = {n: ukrainian.plural("{n} case", "{n} cases", n).format(n=n) for n in (0, 1, 2, 5, 11, 12, 21, 104, 2.5)}
    assert said == {
        0: "0 випадків", 1: "1 випадок", 2: "2 випадки", 5: "5 випадків", 11: "11 випадків", 12: "12 випадків",
        21: "21 випадок", 104: "104 випадки", 2.5: "2.5 випадки",
    }  # fmt: skip
    assert ukrainian.plural("one", "many", 3) == "many"
    file = tmp_path / "uk.po"
    file.write_text(written(ukrainian.header, ukrainian.entries), encoding="utf-8")
    assert read(file).entries == entries


def test_two_branches_that_add_one_text_have_it_once(tmp_path: Path) -> None:
    """The union of two files, line by line, is still a catalogue."""
    file = catalogue_of(tmp_path, 'msgid "a"', 'msgstr ""', 'msgid "a"', 'msgstr "б"', 'msgid "a"', 'msgstr "в"')
    assert read(file).entries == {Key("a"): Entry(("б",))}


@pytest.mark.parametrize("wrong", ['"lost"x', "msgstr[x] 'a'"])
def test_a_file_that_is_no_catalogue_is_refused_with_its_line(tmp_path: Path, wrong: str) -> None:
    with pytest.raises(CatalogueError, match=r"xx\.po: .*line 3"):
        read(catalogue_of(tmp_path, wrong))


def test_what_the_check_finds() -> None:
    """A missing text, one without a use, other places, other tags and too few forms."""
    entries = {
        Key("{n} of {all}"): Entry(("{n} з",)),
        Key("<b>now</b>"): Entry(("<i>нині</i>",)),
        Key("{n} case"): Entry(("{n} випадок",), "{n} cases"),
        Key("a case"): Entry(("випадок", "{n} випадків"), "{n} cases"),
        Key("old"): Entry(("старе",)),
        Key("new"): Entry(("",)),
    }
    found = {key: entry.many for key, entry in entries.items() if key.text != "old"} | {Key("newer"): ""}
    wrong = list(catalogues.faults(type(languages.catalogue("uk"))(HEADER, entries), found))
    assert [line.partition(":")[0] for line in sorted(wrong)] == [
        "has 1 forms of '{n} case'", "has other places or tags", "has other places or tags", "is missing", "is missing",
        "is not used",
    ]  # fmt: skip


def test_texts_of_code_are_found_and_f_strings_refused() -> None:
    code = '_("a " "b")\nx.ngettext("one", "many", n)\npgettext("ctx", "c")\n_(name)\nN_("d")'
    assert dict(catalogues.of_code(catalogues.calls(code), "x.py")) == {
        Key("a b"): "",
        Key("one"): "many",
        Key("c", "ctx"): "",
        Key("d"): "",
    }
    with pytest.raises(ValueError, match=r"x\.py:1"):
        list(catalogues.of_code(catalogues.calls('_(f"{n} cases")'), "x.py"))


def test_texts_of_templates_are_found() -> None:
    source = '{% trans n=x %}one <a href="/docs">{{ n }}</a>{% pluralize %}many{% endtrans %}{{ _("plain") }}'
    assert dict(catalogues.of_template(source)) == {
        Key('one <a href="/docs">%(n)s</a>'): "many",
        Key("plain"): "",
    }
