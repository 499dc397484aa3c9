"""The texts of the scripts in the language of a page, which has them as JSON; English stands in the scripts."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Final

from markupsafe import Markup

from sprag_study.service import languages

_FOLDER: Final = Path(__file__).parent / "static"
_TEXT: Final = re.compile(r'\bsprag\.say\(\s*("(?:[^"\\\n]|\\.)*")')


@cache
def script_texts() -> tuple[str, ...]:
    """Every English text that a script marks by ``sprag.say("...")``."""
    found = {json.loads(text) for file in _FOLDER.glob("*.js") for text in _TEXT.findall(file.read_text("utf-8"))}
    return tuple(sorted(found))


def translated_texts() -> Markup | None:
    """The texts of scripts as a JSON object for a ``script`` element of data; None for English."""
    return None if languages.current() == languages.ENGLISH else _texts_in(languages.current())


@cache
def _texts_in(code: str) -> Markup:
    with languages.language(code):
        texts = {".": languages.decimal(".")} | {text: languages.gettext(text) for text in script_texts()}
    # "<" would end the element where a text has a tag in it.
    return Markup(json.dumps(texts, ensure_ascii=False).replace("<", "\\u003c"))  # noqa: S704 - escaped for its element
