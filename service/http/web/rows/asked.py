"""What the address of the page of rows asks for, and addresses that ask for something else."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, fields, replace
from decimal import Decimal, DecimalException
from typing import TYPE_CHECKING, Any, Final, Literal
from urllib.parse import urlencode

from starlette.datastructures import QueryParams

from sprag_study.sentences import plural
from sprag_study.service.faults import ParameterFault, SelectionError, refused, shown
from sprag_study.service.reading.limits import at_most, span
from sprag_study.service.reading.numbers import in_language, is_ambiguous, parse_number
from sprag_study.service.reading.printed import keyboard
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.results.explore import ExploreQuery, Plan, plan_of
from sprag_study.service.views.rows import first_rows, further_infos
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_SELECTED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.faults import Fault
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

#: A number and what is behind it, and the least digits of a printed result.
_NUMBER: Final = re.compile(r"([-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?)(.*)", re.DOTALL)
_PRINTED: Final = 3
_SIGNS: Final = {"min:": ">=", "max:": "<="}
#: Rows on a page, and most of them; files have more.
ROWS: Final = 25
_MOST_ON_PAGE: Final = 500
#: Most rows beside each other.
MOST_BESIDE: Final = 10
_OF_QUERY: Final = frozenset(one.name for one in fields(ExploreQuery))


@dataclass(frozen=True, slots=True)
class Asked:
    """What the page shows.

    Attributes
    ----------
    query : its rows; ``limit`` on a page, of which ``skip`` come before
    first : whether conditions, order and columns are those that the study has first
    row : number of the chosen row; None for the first one
    beside : numbers of the rows that are shown beside each other, in the place of the table
    plot : a line for each row through all quantities, or two of them as points
    x, y, colour : quantities of the plot; "" for the usual ones
    log, flip : quantities whose axes are logarithmic, and that run the other way
    outside : whether the plot has the rows outside too
    faults : what cannot be asked, each about its parameter of the address
    typed : what stands in the fields of the form for a condition
    """

    query: ExploreQuery
    first: ExploreQuery
    skip: int = 0
    row: int | None = None
    beside: tuple[int, ...] = ()
    plot: Literal["lines", "points"] = "lines"
    x: str = ""
    y: str = ""
    colour: str = ""
    log: tuple[str, ...] = ()
    flip: tuple[str, ...] = ()
    outside: bool = False
    faults: tuple[Fault, ...] = ()
    typed: dict[str, str] = field(default_factory=dict)

    def pairs(self) -> list[tuple[str, str]]:
        """The parameters of the address; what the study has first is left out."""
        query, first = self.query, self.first
        found: list[tuple[str, str]] = []
        if (query.where, query.at) != (first.where, first.at):
            found = [("where", text) for text in query.where or ("",)]
            found += [("at", f"{path}={value}") for path, value in query.at]
        found += [(name, value) for name in ("ending", "regime", "flag") if (value := getattr(query, name))]
        found += [("without", str(case)) for case in query.without]
        found += [("show", name) for name in query.show]
        found += [] if query.sort == first.sort else [("sort", query.sort)]
        found += [] if query.limit == first.limit else [("limit", str(query.limit))]
        found += [("case", str(case)) for case in self.beside]
        found += [(name, str(value)) for name in ("skip", "x", "y", "colour") if (value := getattr(self, name))]
        found += [] if self.plot == "lines" else [("plot", self.plot)]
        found += [(name, value) for name in ("log", "flip") for value in getattr(self, name)]
        found += [("outside", "1")] if self.outside else []
        return found if self.row is None else [*found, ("row", str(self.row))]

    def other(self, **changes: Any) -> Asked:
        """The same with changes of its own fields or those of its query; other rows begin on their first page."""
        of_query = {name: value for name, value in changes.items() if name in _OF_QUERY}
        own = {name: value for name, value in changes.items() if name not in of_query}
        begin = {"skip": 0, "row": None} if of_query else {}
        return replace(self, query=replace(self.query, **of_query), **(begin | own))

    def link(self, **changes: Any) -> str:
        """The query of the address with such changes, as of `other`; it begins with "?"."""
        return f"?{urlencode(self.other(**changes).pairs())}"

    def toggled(self, name: str, kind: Literal["log", "flip"]) -> str:
        """The query of the address where the axis of a quantity is the other way."""
        mine = getattr(self, kind)
        return self.link(**{kind: tuple(one for one in mine if one != name) if name in mine else (*mine, name)})


def read_asked(pairs: Sequence[tuple[str, str]], study: Study, reading: Reading) -> Asked:
    """What an address asks for, whose bare ends of ranges are in the units that the page shows.

    Ranges are ``where`` as in the question of the API, or ``min:NAME`` and ``max:NAME``; those of the form are
    ``least`` and ``most`` of the quantity ``of``, in the place of what was asked of it before. What cannot be asked is
    left out.
    """
    given = QueryParams([pair for pair in pairs if pair[1].strip()])
    first = replace(first_rows(study), limit=ROWS)
    reader = _Reader(study, reading, ExploreQuery(sort=first.sort))
    typed = {name: given.get(name, "").strip() for name in ("of", "least", "most")}
    if all(name not in ("where", "at") and name[:4] not in _SIGNS for name, _ in pairs):
        reader.query = replace(reader.query, where=first.where, at=first.at)
    for text in given.getlist("where"):
        reader.ask("where", text, where=(*reader.query.where, text))
    if typed["of"]:
        reader.forget(typed["of"])
    reader.ends({key: value for key, value in given.multi_items() if key[:4] in _SIGNS})
    reader.ends({key: typed[end] for end, key in _ends(typed["of"]).items() if typed[end]}, typed["of"])
    for path, equals, value in (item.partition("=") for item in given.getlist("at")):
        if equals and value.strip():
            at = (*reader.query.at, (path.strip(), value.strip()))
            reader.ask("at", value, at=at)
    for name in ("ending", "regime", "flag", "sort"):
        if value := given.get(name, ""):
            reader.ask(name, value, **{name: value})
    for name in given.getlist("show"):
        reader.ask("show", name, show=(*reader.query.show, name))
    most = MOST_BESIDE if "do" not in given else MAX_SELECTED
    return Asked(
        replace(
            reader.query,
            without=reader.cases(given.getlist("without"), MAX_SELECTED),
            limit=reader.whole("limit", given.get("limit", str(ROWS)), 1, _MOST_ON_PAGE, ROWS),
        ),
        first,
        skip=reader.whole("skip", given.get("skip", "0"), 0, study.cases, 0),
        row=next(iter(reader.cases([given["row"]], 1)), None) if "row" in given else None,
        beside=reader.cases(given.getlist("case"), most),
        plot="points" if given.get("plot") == "points" else "lines",
        x=reader.known("x", given),
        y=reader.known("y", given),
        colour=reader.known("colour", given),
        log=tuple(dict.fromkeys(given.getlist("log"))),
        flip=tuple(dict.fromkeys(given.getlist("flip"))),
        outside="outside" in given,
        faults=tuple(reader.faults),
        typed=typed,
    )


def rounded_to(text: str) -> tuple[str, str]:
    """The ends of the numbers that are printed as this quantity: ``321.5 rpm`` and ``322.5 rpm`` of ``322 rpm``.

    Pages print no fewer than three digits.
    """
    typed = _NUMBER.match(in_language(keyboard(text.strip())).replace("\N{MINUS SIGN}", "-"))
    if typed is None or is_ambiguous(text):
        return text, text
    try:
        number = Decimal(typed[1].replace(",", "."))
        last = min(int(number.as_tuple().exponent), number.adjusted() - _PRINTED + 1)
        half = Decimal(5).scaleb(last - 1)
        return f"{number - half}{typed[2]}", f"{number + half}{typed[2]}"
    except DecimalException:  # an exponent that no number has; what is wrong with it is told where it is read
        return text, text


def _ends(name: str) -> dict[str, str]:
    return {"least": f"min:{name}", "most": f"max:{name}"}


class _Reader:
    """What has been asked so far, and what could not be."""

    def __init__(self, study: Study, reading: Reading, query: ExploreQuery) -> None:
        self.study, self.reading, self.query = study, reading, query
        self.faults: list[Fault] = []
        self.further = further_infos(study)
        self.units = self.plan(query).units
        self.rounded = {info.name for info in models.study_results(study) if info.kind == "real"}

    def plan(self, query: ExploreQuery) -> Plan:
        """The checked question; raises SelectionError."""
        return plan_of(self.study, query, self.further)

    def ask(self, parameter: str, given: str, **changes: Any) -> None:
        """Ask for more, or tell what is wrong with a parameter of the address."""
        wanted = replace(self.query, **changes)
        try:
            self.plan(wanted)
        except SelectionError as error:
            self.faults.extend(replace(fault, where=parameter, value=shown(given)) for fault in error.faults)
        else:
            self.query = wanted

    def forget(self, name: str) -> None:
        """Take away the ranges of a quantity."""
        ranges = zip(self.query.where, self.plan(self.query).ranges, strict=True)
        self.query = replace(self.query, where=tuple(text for text, one in ranges if one.name != name))

    def ends(self, ends: dict[str, str], of: str = "") -> None:
        """Ask for ends of ranges; a bare lower one has the unit of the upper one. ``of`` is that of the form."""
        for key, text in ends.items():
            name, low = key[4:], f"min:{key[4:]}"
            both = with_last_unit([ends[low], ends.get(f"max:{name}", "")]) if low in ends else ["", text]
            text_of_end = both[key == f"max:{name}"].strip()
            if ends.get(low, "").strip() == ends.get(f"max:{name}", "").strip() and name in self.rounded:
                text_of_end = rounded_to(text_of_end)[key != low]
            value = self.reading.with_unit(text_of_end, self.units.get(name, "1"))
            where = key if not of else "least" if key == low else "most"
            self.ask(where, text.strip(), where=(*self.query.where, f"{name} {_SIGNS[key[:4]]} {value}"))

    def whole(self, parameter: str, text: str, low: int, high: int, usual: int) -> int:
        """A whole number of the address."""
        number = parse_number(text)
        if number is not None and low <= number <= high and number == int(number):
            return int(number)
        allowed = span(str(low), str(high))
        self.faults.append(ParameterFault(parameter, "out-of-range", "is not a number of rows", shown(text), allowed))
        return usual

    def cases(self, texts: Sequence[str], most: int) -> tuple[int, ...]:
        """Numbers of rows, each once."""
        found: dict[int, None] = {}
        if len(texts) > most:
            count = plural("{count} case is given", "{count} cases are given", len(texts))
            self.faults.extend(refused("case", "too-many", count, allowed=at_most(most)).faults)
        for text in texts[:most]:
            number = parse_number(text)
            if number is not None and 0 <= number < self.study.cases and number == int(number):
                found[int(number)] = None
            else:
                allowed = span(0, self.study.cases - 1)
                self.faults.append(ParameterFault("case", "out-of-range", "is not a case", shown(text), allowed))
        return tuple(found)

    def known(self, parameter: str, given: QueryParams) -> str:
        """A quantity of the plot."""
        name = given.get(parameter, "")
        if not name or name in self.units:
            return name
        self.ask(parameter, name, sort=name)  # which says what there is
        return ""
