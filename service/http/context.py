"""Context of the operations: settings, store and computer of the running service."""

from __future__ import annotations

from asyncio import Semaphore
from dataclasses import dataclass, field
from threading import Event
from typing import TYPE_CHECKING, Annotated, Final, cast

from fastapi import Depends, Path, Query, Request
from starlette.convertors import Convertor, register_url_convertor

from sprag_study.service.http.computer import Computes
from sprag_study.service.http.kept_files import KeptFiles
from sprag_study.service.http.looks import Looks
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.shares import Shares
from sprag_study.service.settings import EffectiveSetting, Settings
from sprag_study.service.storage.store import Store
from sprag_study.service.views.case_view import outside
from sprag_study.service.views.library import Library
from sprag_study.worker.limits import (
    MAX_CASES,
    MAX_CHECKS,
    MAX_CHECKS_EACH,
    MAX_COMPUTATIONS,
    MAX_COMPUTATIONS_EACH,
    MAX_FILES,
    MAX_FILES_EACH,
    MAX_STARTS,
    MAX_STREAMS,
    MAX_STREAMS_EACH,
    SENDING_PROCESSES,
)

if TYPE_CHECKING:
    from sprag_study.worker.study import Study

CaseNumber = Annotated[
    int,
    Path(
        ge=0,
        description="number of the case, from 0",
        examples=[0],
        json_schema_extra={"maximum": MAX_CASES - 1},
    ),
]


class Ready(Event):
    """Set when the checking processes accept work; ``problem`` says why they did not at the last try."""

    problem: str = ""


@dataclass(frozen=True, slots=True)
class Context:
    """Settings, store and computer of one service, and the ``files`` of ended studies.

    ``origins`` are the settings with where each came from at the start.
    ``ending`` is set when the service begins to shut down.
    ``checker`` runs the functions that read, expand, fit or draw user input, and ``library`` gives them the store.
    ``writer`` writes files of rows, and ``sending`` are the places for rows that are sent meanwhile. Requests use all
    of them through `sprag_study.service.http.work`, which enforces the share of each token.
    ``streams`` are the places for event streams,
    ``stream_shares`` the share of each token of them, and ``looks`` what these look at.
    ``ready`` is set when the checker accepts work, ``visited`` when a page is asked for.
    """

    settings: Settings
    store: Store
    computer: Computes
    checker: Computes
    writer: Computes
    library: Library
    ending: Event = field(default_factory=Event)
    ready: Ready = field(default_factory=Ready)
    visited: Event = field(default_factory=Event)
    streams: Semaphore = field(default_factory=lambda: Semaphore(MAX_STREAMS))
    compute_shares: Shares = field(default_factory=lambda: Shares(1, MAX_COMPUTATIONS_EACH, MAX_COMPUTATIONS))
    check_shares: Shares = field(default_factory=lambda: Shares(1, MAX_CHECKS_EACH, MAX_CHECKS))
    stream_shares: Shares = field(default_factory=lambda: Shares(MAX_STREAMS_EACH, MAX_STREAMS_EACH, MAX_STREAMS))
    file_shares: Shares = field(default_factory=lambda: Shares(1, MAX_FILES_EACH, MAX_FILES))
    looks: Looks = field(default_factory=Looks)
    sending: Semaphore = field(default_factory=lambda: Semaphore(SENDING_PROCESSES))
    files: KeptFiles = field(default_factory=KeptFiles)
    origins: tuple[EffectiveSetting, ...] = ()

    def cut(self) -> None:
        """Stop computations and refuse writes; waiting requests are notified. Takes as long as killing the
        processes.
        """
        self.store.session.refuse_writes()
        for computer in (self.checker, self.computer, self.writer):
            computer.close()


#: Pattern of an id; a colon would begin a verb.
ID_PATTERN: Final = "^[A-Za-z0-9_-]{1,64}$"


class StudyIdConvertor(Convertor[str]):
    """Path segment with the id of a study; a colon would begin a verb."""

    regex = ID_PATTERN.strip("^$")

    def convert(self, value: str) -> str:
        """The id, unchanged."""
        return value

    def to_string(self, value: str) -> str:
        """The id, unchanged."""
        return value


class CaseConvertor(StudyIdConvertor):
    """Path segment with the number of a case, limited to the digits of the largest number."""

    regex = "[0-9]{1,12}"


register_url_convertor("study", StudyIdConvertor())
register_url_convertor("case", CaseConvertor())


async def _context(request: Request) -> Context:
    return cast("Context", request.app.state.context)


Ctx = Annotated[Context, Depends(_context)]
StudyId = Annotated[str, Path(description="id of the study", pattern=ID_PATTERN, examples=["st_0123456789abcdef"])]


def study_with(context: Context, study_id: str, case: int) -> Study:
    """The study, when it has that case; ApiError else."""
    study = context.store.studies.study(study_id)
    if case >= study.cases:
        raise ApiError("case-not-found", outside(study))
    return study


#: The start of a case of a study with `starts`.
StartNumber = Annotated[
    int | None,
    Query(
        alias="start",
        ge=0,
        le=MAX_STARTS - 1,
        description="of a case with many starts: which of them; by default 0, its own",
    ),
]
