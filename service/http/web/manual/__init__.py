"""Pages of docs/ for designers, shown by the service: guide, theory and what they refer to.

The files of this folder are links into docs/, which a wheel has as files.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from markdown_it import MarkdownIt
from markupsafe import Markup

from sprag_study.service.http.current import current
from sprag_study.service.http.prefix import here

if TYPE_CHECKING:
    from collections.abc import Iterator

    from markdown_it.token import Token

#: Names of the pages, in the order of their list.
PAGES: Final = (
    "guide", "guide-machine-shaft", "guide-refinement", "guide-goals", "guide-tolerances", "guide-calibration",
    "theory", "theory-machine-shaft", "sampling", "starts", "sweeps", "branches", "refinement", "goals", "tolerances",
    "calibration", "presets", "reference",
)  # fmt: skip
#: A link to another page of docs/, with or without a heading.
_LINK: Final = re.compile(r"(?P<name>[\w-]+)\.md(?P<heading>#.+)?")
#: Marks of the parts of a page that a command writes.
_COMMENT: Final = re.compile(r"^<!--.*?-->\n", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True, slots=True)
class ManualPage:
    """A page: the text of its first heading, and its HTML."""

    title: str
    html: Markup


def manual_page(name: str) -> ManualPage:
    """The page of that name, one of `PAGES`."""
    return _page(name, current().prefix)


def titles() -> dict[str, str]:
    """Titles of all pages by name."""
    return {name: _source(name).partition("\n")[0].removeprefix("# ") for name in PAGES}


@cache
def _source(name: str) -> str:
    return (files(__package__) / f"{name}.md").read_text(encoding="utf-8")


@cache
def _page(name: str, prefix: str) -> ManualPage:  # noqa: ARG001 - addresses depend on it
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = list(_for_page(reader.parse(_COMMENT.sub("", _source(name)))))
    html = reader.renderer.render(tokens, reader.options, {})
    # Wide tables and equations scroll by themselves, by the keyboard too.
    html = html.replace("<table>", '<div class="scroll" tabindex="0"><table>').replace("</table>", "</table></div>")
    return ManualPage(titles()[name], Markup(html.replace("<pre>", '<pre tabindex="0">')))  # noqa: S704 - no HTML in it


def _for_page(tokens: list[Token]) -> Iterator[Token]:
    """The tokens with ids of headings and addresses of this service; pictures are left out."""
    taken: dict[str, int] = {}
    for token, following in zip(tokens, [*tokens[1:], None], strict=True):
        if token.type == "heading_open" and following is not None:
            token.attrSet("id", _heading_id(following.content, taken))
        if token.children is not None:
            token.children = list(_linked(token.children))
        yield token


def _heading_id(text: str, taken: dict[str, int]) -> str:
    """The id that GitHub gives a heading; ``taken`` counts those of the page so far."""
    own = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
    count = taken.get(own, 0)
    taken[own] = count + 1
    return f"{own}-{count}" if count else own


def _linked(tokens: list[Token]) -> Iterator[Token]:
    """The parts of a line: links to pages that are not shown are their text alone."""
    kept = True
    for token in tokens:
        if token.type == "image":
            continue
        if token.type == "link_open":
            address = _address(str(token.attrs["href"]))
            kept = bool(address)
            token.attrSet("href", address)
        if token.type not in {"link_open", "link_close"} or kept:
            yield token


def _address(target: str) -> str:
    """The address of a link's target; "" where the service does not show it."""
    if target.startswith("#"):
        return target
    found = _LINK.fullmatch(target)
    return here(f"/help/{found['name']}{found['heading'] or ''}") if found and found["name"] in PAGES else ""
