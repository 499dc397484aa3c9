"""Views on pages: what is asked of one as a form, its figure, and what people read beside it.

The form is made of the settings of the view's question (`sprag_study.service.views.setting`), for cases and for
studies.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from urllib.parse import urlencode

from markupsafe import Markup

from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.figures.read import read_figure
from sprag_study.service.formats import PICTURES
from sprag_study.service.http.web.figures.drawn import drawn
from sprag_study.service.languages import gettext
from sprag_study.service.views.setting import NamedSetting, Offered, ViewInfo, question_of, settings_of
from sprag_study.service.views.shown import NOTHING, Shown

if TYPE_CHECKING:
    from starlette.datastructures import QueryParams

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.headlines.headline import KeyNumber

#: No figure.
EMPTY: Final = Markup()


@dataclass(frozen=True, slots=True)
class Field:
    """A setting as a field: what was given, and what the study offers."""

    asked: NamedSetting
    given: tuple[str, ...]
    offered: Offered

    @property
    def values(self) -> tuple[str, ...]:
        """What is asked: what was given, otherwise what is usual."""
        return self.given or self.offered.usual


@dataclass(frozen=True, slots=True)
class Asked:
    """What the address of a page asks of a view.

    Attributes
    ----------
    fields : those of its form
    chosen : what the view makes of them
    faults : what is wrong
    ready : whether nothing is missing or wrong
    exact : parameters of an address in the place of those of the fields, where more is shown than was asked
    """

    about: ViewInfo
    fields: tuple[Field, ...]
    chosen: Any
    faults: tuple[Fault, ...] = ()
    ready: bool = True
    exact: Sequence[tuple[str, str]] = ()

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """What is asked as parameters of an address."""
        return [*self.exact] or [(one.asked.alias, text) for one in self.fields for text in one.values]


class Fact(NamedTuple):
    """A number that is shown large: what it is, the number and its unit, and what stands below."""

    title: str
    value: str
    unit: str = ""
    below: str = ""
    address: str = ""


def fact_of(one: KeyNumber, reading: Reading, cases: str = "") -> Fact:
    """A key number as it is shown; ``cases`` is where the case that it was read from is found."""
    below = " · ".join(filter(None, (reading.say(one.where), reading.say(one.note))))
    address = f"{cases}{one.case}" if cases and one.case is not None else ""
    return Fact(one.title(reading), one.number(reading), one.unit_text(reading), below, address)


@dataclass(frozen=True, slots=True)
class Seen:
    """A view as a page shows it: its figure, "" for none, and what people read of it; or a note why there is nothing.

    ``others`` is what the figure has no room for. ``later`` says that the page has to ask for it once more;
    ``frames`` move the drawing of a machine. ``further`` is the address of what the answer advises, and its label.
    """

    figure: Markup = EMPTY
    others: Markup = EMPTY
    shown: Shown = NOTHING
    note: str = ""
    later: bool = False
    frames: Mapping[str, Any] | None = None
    further: tuple[str, str] | None = None


def inline(figure: Figure, reading: Reading, shown: Shown, cases: str, *, broad: bool = False) -> Seen:
    """A view with a figure, as its reader reads it; the sentence below it only where none beside it says the same.

    ``cases`` is the address of the cases of its points, which their numbers follow; ``broad`` as of `drawn`.
    """
    read = read_figure(figure, reading)
    if any(read.below in reading.say(text) for text in shown.sentences):
        read = replace(read, below="")
    return Seen(drawn(read, cases=cases, broad=broad), shown=shown)


def asked_of(
    about: ViewInfo, params: QueryParams, offered: Mapping[str, Offered], choose: Callable[[Any], Any]
) -> Asked:
    """What an address asks of a view. Faults of what nobody has typed are not told: something is missing."""
    settings = settings_of(about.question)
    fields = tuple(
        Field(one, tuple(filter(str.strip, params.getlist(one.alias))), offer)
        for one in settings
        if not (offer := offered.get(one.alias, Offered())).left_out
    )
    texts = {one.asked.alias: one.values for one in fields}
    if any(one.default is ... and not texts.get(one.alias) for one in settings):
        return Asked(about, fields, None, ready=False)
    try:
        return Asked(about, fields, choose(question_of(about.question, texts)))
    except FaultError as error:
        told = error.faults if any(one.given for one in fields) else ()
        return Asked(about, fields, None, told, ready=False)


def files_of(address: str, asked: Asked, further: Sequence[tuple[str, str]] = ()) -> list[tuple[str, str]]:
    """The files of a view, each its kind and its address, of which ``address`` is that of the interface."""
    query = [*asked.pairs, *further]
    tables = [one for one in settings_of(asked.about.question) if one.setting.choices and not one.setting.label]
    csv = [
        (f"csv, {gettext(word)}", [("format", "csv"), (one.alias, choice)])
        for one in tables
        for choice, word in zip(one.setting.choices, one.setting.words or one.setting.choices, strict=True)
    ] or [
        ("csv", [("format", "csv")]),
        (gettext("csv with decimal commas"), [("format", "csv"), ("decimal", "comma")]),
    ]
    others = [(form, [("format", form)]) for form in ("json", *(PICTURES if asked.about.pictures else ()))]
    return [(name, f"{address}?{urlencode([*query, *own])}") for name, own in (*csv, *others)]
