"""What a study asks of a service, answered in this process: the same views of the same rows, without HTTP."""

from __future__ import annotations

import json
import re
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TypeVar

from sprag_study.service import languages
from sprag_study.service.client.errors import RefusedError
from sprag_study.service.client.events import StudyEvent
from sprag_study.service.client.synchronous.connection import Connection
from sprag_study.service.client.wire import plain_body
from sprag_study.service.exports.decimal_commas import with_decimals
from sprag_study.service.faults import FaultError, choice_of, parameter_error
from sprag_study.service.formats import DECIMALS, FORMATS, HEADERS, PICTURES
from sprag_study.service.http.problems import as_api_error, problem_json
from sprag_study.service.http.views import case_detail, whole_detail
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.submission import accept
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading.limits import span
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.reading.quantities import SI
from sprag_study.service.reading.reader import CAPTIONS, Choice
from sprag_study.service.report import REPORT_FORMATS, Office, report_file
from sprag_study.service.results.rounds import round_json
from sprag_study.service.results.start_states import check_start
from sprag_study.service.spec.text import Body
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.views import row_files
from sprag_study.service.views.case_pages import case_page, page_json, wanted
from sprag_study.service.views.case_view import drawn, outside, see, written
from sprag_study.service.views.cases import CASE_VIEWS
from sprag_study.service.views.curves import pairs
from sprag_study.service.views.explore import selection
from sprag_study.service.views.library import Library
from sprag_study.service.views.queries import asked
from sprag_study.service.views.studies import STUDY_VIEWS
from sprag_study.service.views.study_questions import CasesQuestion, ReportQuestion, SelectQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView, answer_of, is_drawn
from sprag_study.service.views.study_view import written as written_view
from sprag_study.worker.limits import (
    MAX_NARROW_STEPS,
    MAX_SETTLED_PERIODS,
    MAX_STARTS,
    MIN_NARROW_STEPS,
    MIN_SETTLED_PERIODS,
    NARROW_STEPS,
)
from sprag_study.worker.states import TransitionError

if TYPE_CHECKING:
    from sprag_study.service.client.wire import Query
    from sprag_study.service.settings import Settings
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.study import Study

View = TypeVar("View")

_STUDY: Final = re.compile(r"/studies/([^/:]+)(.*)")
_CASE: Final = re.compile(r"/cases/(\d+)(?:/(\w+))?")
#: Formats of rows in the order of a service.
_ROWS: Final = tuple(dict.fromkeys(("json", *FORMATS)))


class Here(Connection):
    """The studies of a database, as a connection to a service has them.

    Parameters
    ----------
    store : Store
    settings : Settings
        Whose office and templates reports have.
    """

    def __init__(self, store: Store, settings: Settings) -> None:
        self.server, self.retry, self._answered = "this process", 0.0, True
        self.library = Library(store)
        self._settings = settings
        #: The latest view of a study: a table and a file of it are often asked for one after the other.
        self._latest: tuple[tuple[object, ...], StudyAnswer[Any, Any]] | None = None

    def require_open(self) -> None:
        """Raise StoreError where the database is closed."""

    def run(self, record: StudyRecord) -> StudyRecord:
        """Run a study of the database to its end; only where further studies are asked for."""
        raise NotImplementedError

    def request(self, method: str, path: str, **arguments: Any) -> dict[str, Any]:
        """The JSON object that a service answers; RefusedError."""
        self.require_open()
        study_id, part = _parts(path)
        with _refusing():
            if method != "GET":
                body = plain_body(arguments.get("json"))
                record = accept(
                    self.library.store, self._further(study_id, part, list(arguments.get("params", ())), body)
                )
                self.run(record)
                return {"id": record.id}
            answer: dict[str, Any] = json.loads(b"".join(self._content(study_id, part, arguments.get("params", ()))))
        return answer

    def delete(self, path: str, *_: Any, **__: Any) -> None:
        """Refused, as what else changes a study that has ended."""
        self.request("DELETE", path)

    @contextmanager
    def pieces(self, path: str, query: Query) -> Iterator[Iterator[bytes]]:
        """The bytes of a document, piece by piece."""
        self.require_open()
        with _refusing():
            yield iter(self._content(*_parts(path), query))

    def events(self, study_id: str, *_: Any, **__: Any) -> Generator[StudyEvent | None, None, None]:
        """The last event of a study: it has ended."""
        detail: Any = self.request("GET", f"/studies/{study_id}")
        yield StudyEvent("1", "end", detail["state"], detail["reason"], detail["progress"])

    def _further(self, study_id: str, verb: str, query: Query, body: Any) -> ParsedSpec:
        """The study that a verb makes of another one."""
        library, given = self.library, dict(query)
        if verb == ":extend":
            return checks.extended_study(library, study_id, Body(to_bytes(body)))
        if verb == ":longer":
            kind = checks.kind_to_run_longer(library.store, study_id, given.get("regime"))
            most = _whole(given, "at_most", MIN_SETTLED_PERIODS, MAX_SETTLED_PERIODS)
            return checks.longer_study(library, study_id, kind, most)
        if verb == ":narrow":
            held = pairs([text for name, text in query if name == "at"])
            steps = _whole(given, "steps", MIN_NARROW_STEPS, MAX_NARROW_STEPS) or NARROW_STEPS
            return checks.narrowed_study(library, study_id, steps, held)
        if verb == ":select":
            question = asked(SelectQuestion, query)
            return checks.selected_study(library, study_id, selection(question, question.limit))
        raise FaultError("method-not-allowed", "This is for studies of a service: one that was run here has ended.")

    def _content(self, study_id: str, part: str, query: Query) -> Iterable[bytes]:
        """What lies at an address, as JSON unless the query has another ``format``."""
        given = dict(query)
        decimal = choice_of("decimal", given.get("decimal", "point"), DECIMALS)
        if decimal != "point" and given.get("format") != "csv":
            raise parameter_error("decimal", "not-used", "only CSV has it", decimal, "in csv")
        answer = self._answer(study_id, part, [item for item in query if item[0] != "decimal"])
        return with_decimals(answer, decimal)

    def _answer(self, study_id: str, part: str, query: Query) -> Iterable[bytes]:
        given, library = dict(query), self.library
        form = given.get("format", "json")
        study = library.store.studies.study(study_id)
        choice = Choice(
            given.get("units", self._settings.units if part == "/report" else SI), given.get("names", CAPTIONS)
        )
        language = choice_of("language", given.get("language", languages.ENGLISH), languages.available())
        with languages.language(language):
            if part == "":
                return [to_bytes(whole_detail(library, *library.store.studies.look(study_id)))]
            if part == "/rounds":
                rounds = map(round_json, library.store.studies.rounds(study_id))
                return [to_bytes({"study": study_id, "rounds": list(rounds)})]
            if part == "/results":
                header = choice_of("header", given.get("header", "names"), HEADERS)
                rows = choice_of("format", form, _ROWS)
                return row_files.pieces(library, study_id, rows, choice.units, header, "")
            if part == "/report":
                question, chosen = asked(ReportQuestion, query), choice_of("format", form, REPORT_FORMATS)
                office = Office.of(self._settings)
                return [report_file(library, study_id, choice, question, office, chosen)]
            if part == "/cases":
                cases = asked(CasesQuestion, query)
                page = case_page(library, study_id, wanted(cases), cases.page_token)
                return [to_bytes(page_json(study, page))]
            if of_case := _CASE.fullmatch(part):
                return [self._case(study_id, study, int(of_case[1]), of_case[2], form, query)]
            view = _known(STUDY_VIEWS, part[1:])
            choice_of("format", form, ("json", "csv", *PICTURES))
            answer = self._found(study_id, view, view.choose(study, asked(view.about.question, query)), form)
            return [written_view(view, answer, choice, study.name or study.model, form)]

    def _found(self, study_id: str, view: StudyView[Any, Any, Any], chosen: Any, form: str) -> StudyAnswer[Any, Any]:
        revision, is_picture = self.library.store.studies.get(study_id).revision, view.drawn_differs and is_drawn(form)
        asked_for = (study_id, revision, view.about.name, chosen, is_picture)
        latest = self._latest  # another thread may ask for another view meanwhile
        if latest is None or latest[0] != asked_for:
            latest = self._latest = asked_for, answer_of(self.library, study_id, view, chosen, drawn=is_picture)
        return latest[1]

    def _case(self, study_id: str, study: Study, case: int, name: str | None, form: Any, query: Query) -> bytes:
        if case >= study.cases:
            raise FaultError("case-not-found", outside(study))
        if name is None:
            return to_bytes(case_detail(self.library.store, study_id, study, case))
        view = _known(CASE_VIEWS, name)
        choice_of("format", form, ("json", "csv", *(PICTURES if view.about.pictures else ())))
        start = _whole(dict(query), "start", 0, MAX_STARTS - 1)
        check_start(study, start)
        answer = see(study, case, view, view.choose(study, case, asked(view.about.question, query)), start)
        return drawn(view, answer, form) if form in PICTURES else written(view, answer, form)


def _parts(path: str) -> tuple[str, str]:
    """The study of an address, and the part of it."""
    found = _STUDY.fullmatch(path)
    assert found is not None
    return found[1], found[2]


def _known(views: Mapping[str, View], name: str) -> View:
    if name not in views:
        raise FaultError("not-found", f"There is no view {name!r}; these are known: {', '.join(views)}.")
    return views[name]


def _whole(given: Mapping[str, Any], name: str, low: int, high: int) -> int | None:
    """A whole number of a query within its limits; None where it is not given."""
    text = str(given.get(name, ""))
    number = whole_number(text, high + 1)
    if text and (number is None or number < low):
        raise parameter_error(name, "out-of-range", "must be a whole number", text, span(low, high))
    return number


@contextmanager
def _refusing() -> Iterator[None]:
    """Refuse as a service does, so that a script catches one error for both."""
    try:
        yield
    except (FaultError, StoreError, TransitionError) as error:
        problem = as_api_error(error)
        assert problem is not None
        document = problem_json(problem.type, problem.detail, problem.faults)
        raise RefusedError(problem.type.status, document) from error
