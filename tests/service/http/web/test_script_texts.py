"""The texts of scripts: each is said in the language of the page, none stands in a script otherwise."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import pytest
from playwright.sync_api import expect

from sprag_study.service import languages
from sprag_study.service.http.web import script_texts
from tests.acceptance.processes import SECONDS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from playwright.sync_api import Browser

    from tests.service.http.web.conftest import Office

_SCRIPTS: Final = sorted(script_texts._FOLDER.glob("*.js"))
#: Comments, and the literals of texts: with both quotes, and templates.
_TOKEN: Final = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)"""
    r"""|(?P<text>"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)*'|`(?:[^`\\]|\\.)*`)""",
    re.DOTALL,
)
#: What stands in a template for a value.
_VALUE: Final = re.compile(r"\$\{(?:[^{}]|\{[^{}]*\})*\}")
#: Where a script shows a text: in the rest of the statement, or of the arguments.
_SHOWN: Final = re.compile(
    r"\.(?:textContent|innerText|title|placeholder|alt|ariaLabel|innerHTML)\s*\+?=(?!=)"
    r"|\btextContent:"
    r"|setAttribute\(\s*\"(?:aria-\w+text|aria-label|title|alt|placeholder)\","
    r"|\b(?:alert|confirm|prompt|append|prepend|before|after|createTextNode|Error|super|note|fail)\("
)
#: Attributes and selectors may have several words; a sentence begins with a capital letter or ends with a mark.
_SENTENCE: Final = re.compile(r"^[A-Z][a-z]+ [a-z]|[a-z] [a-z]+[.!?]$")


def shown(script: str) -> Iterator[str]:
    """Literals with words where a script shows a text, and sentences anywhere, but for those that `sprag.say` takes."""
    # Literals without their contents, and no comments: brackets and names are those of the code.
    bare = _TOKEN.sub(lambda found: " " * len(found[0]) if found["comment"] else _quoted(found[0]), script)
    places = {
        at for found in _SHOWN.finditer(script) if bare[found.start()] != " " for at in _direct(bare, found.end())
    }
    for found in _TOKEN.finditer(script):
        if found["comment"] or re.search(r"\bsprag\.say\(\s*$", bare[max(found.start() - 40, 0) : found.start()]):
            continue
        text = _VALUE.sub("", found["text"][1:-1])
        if _SENTENCE.search(text) or (found.start() in places and re.search(r"[A-Za-z]{2}", text)):
            yield text


def _quoted(literal: str) -> str:
    return literal[0] + "_" * (len(literal) - 2) + literal[-1]


def _direct(bare: str, begin: int) -> Iterator[int]:
    """Places up to the end of a statement or of arguments, without those in the arguments of further calls."""
    depth, calls = 0, []
    for at in range(begin, len(bare)):
        if bare[at] in "([{":
            depth += 1
            if bare[at] != "{" and re.match(r"[\w)\].]", bare[at - 1]):
                calls.append(depth)
        elif bare[at] in ")]}":
            if calls and calls[-1] == depth:
                calls.pop()
            depth -= 1
        if depth < 0 or (depth == 0 and bare[at] == ";"):
            return
        if not calls:
            yield at


def test_there_are_scripts_with_texts() -> None:
    assert len(_SCRIPTS) > 10
    # 19 since the sheet of a new study has no hints and keys of its own as the laboratory had.
    assert len(script_texts.script_texts()) >= 19
    assert all(before < after for before, after in pairwise(script_texts.script_texts()))


@pytest.mark.parametrize("script", _SCRIPTS, ids=lambda file: file.stem)
def test_every_text_that_a_script_says_is_collected(script: Path) -> None:
    text = script.read_text("utf-8")
    assert len(script_texts._TEXT.findall(text)) == len(re.findall(r"\bsprag\.say\(", text))


@pytest.mark.parametrize("script", _SCRIPTS, ids=lambda file: file.stem)
def test_no_text_stands_in_a_script_that_no_language_has(script: Path) -> None:
    assert list(shown(script.read_text("utf-8"))) == []


@pytest.mark.parametrize(
    "script",
    [
        'note.textContent = "Try again";',
        "place.textContent = busy ? `status ${code}` : sprag.say('x');",
        'button.setAttribute("aria-label", "Close");',
        'throw new Error("refused");',
        'alert("no");',
        'const words = "What nobody has translated.";',
        'Object.assign(button, { type: "button", textContent: "Go" });',
    ],
)
def test_the_search_finds_texts(script: str) -> None:
    assert list(shown(script))


@pytest.mark.parametrize(
    "script",
    [
        'note.textContent = sprag.say("Try again");',
        "place.textContent = `${x} / ${y}`;",
        '// note.textContent = "Try again";',
        'bar.className = "notice bar screen";',
    ],
)
def test_the_search_leaves_out_what_is_said(script: str) -> None:
    assert list(shown(script)) == []


def test_pages_have_the_texts_of_scripts() -> None:
    assert script_texts.translated_texts() is None
    with languages.language("uk"):
        texts = script_texts.translated_texts()
    assert texts is not None
    assert '".": ","' in texts
    assert "Спробувати зараз" in texts


def test_a_script_speaks_the_language_of_the_page(office: Office, browser: Browser) -> None:
    context = browser.new_context(base_url=office.address, locale="uk-UA")
    context.set_default_timeout(1000 * SECONDS)
    page = context.new_page()
    page.goto("/new")
    play = page.locator("#play")
    expect(page.locator("html")).to_have_attribute("lang", "uk")
    expect(play).to_have_text("Призупинити")
    play.click()
    expect(play).to_have_text("Пуск")
    context.set_offline(True)
    page.locator('[name="/base/shaft/load"]').fill("0.2")
    expect(page.get_by_role("alert").first).to_contain_text("Зв’язок зі службою втрачено")
    context.close()
