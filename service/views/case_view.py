"""The views of a case: what each is asked, who has it, how it is computed, and how it is written and drawn.

One description serves the address of the API, the section of a page, and the command: see
`sprag_study.service.http.api.case_views`, `sprag_study.service.http.web.motion` and
`sprag_study.service.cli.case_views`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Literal, TypeVar

from sprag_study.sentences import Sentence
from sprag_study.service.figures.pictures import draw_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading.directions import case_values
from sprag_study.service.reading.reader import Reading
from sprag_study.service.views.shown import Shown
from sprag_study.worker import models
from sprag_study.worker.models.starts import motion_of

if TYPE_CHECKING:
    from sprag_study.service.answers import Value
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.formats import Picture
    from sprag_study.service.storage.store import Store
    from sprag_study.service.views.setting import Offered, ViewInfo
    from sprag_study.worker.models import KernelShape
    from sprag_study.worker.study import Study

Question = TypeVar("Question")
Chosen = TypeVar("Chosen")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class CaseAnswer(Generic[Chosen, Result]):
    """A view of a case: of which study and case, what was chosen, and what was computed.

    ``rows`` are what its figure shows of the rows of the study, as `CaseView.rows` gives them.
    """

    study: Study
    case: int
    chosen: Chosen
    result: Result
    rows: Any = None

    @property
    def parameters(self) -> dict[str, Value]:
        """The parameters of the case on axes and derived ones, SI."""
        return case_values(self.study, self.case)


def outside(study: Study) -> Sentence:
    """Which cases a study has, for who asks for another."""
    return Sentence("The cases of this study are 0 to {last}.", last=study.cases - 1)


@dataclass(frozen=True, slots=True)
class Said:
    """What a command tells programs of a view that it has written; people read what is shown of it.

    Attributes
    ----------
    data : mapping
        What is shown, for programs that asked for a file.
    ok : bool
        Whether the motion came to its end.
    """

    data: Mapping[str, Any]
    ok: bool = True


class CaseView(ABC, Generic[Question, Chosen, Result]):
    """A view of a case.

    Attributes
    ----------
    about : ViewInfo
        Its name, its question, and what it is.
    content : str
        What its files have, a sentence for the API.
    shape : type
        That of its JSON.
    lacks : str
        What is said of a machine that has no such view.
    """

    about: ClassVar[ViewInfo]
    content: ClassVar[str]
    shape: ClassVar[Any]
    lacks: ClassVar[str] = ""

    @abstractmethod
    def choose(self, study: Study, case: int, question: Question) -> Chosen:
        """What a question means for a case; FaultError about a setting, or where the case has no such view."""

    @property
    def drawn(self) -> bool:
        """Whether it has a figure."""
        return type(self).figure is not CaseView.figure

    def has(self, study: Study) -> bool:
        """Whether the cases of a study have it."""
        return True

    def offered(self, study: Study, case: int) -> Mapping[str, Offered]:
        """What a study offers for the settings, by alias."""
        return {}

    def kernels(self, study: Study) -> tuple[KernelShape, ...]:
        """The kernels that the computation needs."""
        return (models.shape_of(study),)

    @abstractmethod
    def compute(self, study: Study, case: int, chosen: Chosen) -> Result:
        """Run the case for the view. In a process that computes."""

    @abstractmethod
    def json(self, answer: CaseAnswer[Chosen, Result]) -> Mapping[str, Any]:
        """The view as JSON data."""

    @abstractmethod
    def csv(self, answer: CaseAnswer[Chosen, Result]) -> bytes:
        """The view as a table."""

    def rows(self, store: Store, study_id: str, study: Study, case: int, chosen: Chosen) -> Any:
        """What its figure shows of the rows of the study; None: nothing, so that it never changes."""
        return None

    def figure(self, answer: CaseAnswer[Chosen, Result], columns: int = 2) -> Figure:
        """The view as a described figure, with so many panels in a row."""
        raise NotImplementedError  # those without pictures

    def file_name(self, chosen: Chosen) -> str:
        """The last part of the name of its file."""
        return self.about.name

    def shown(self, answer: CaseAnswer[Chosen, Result]) -> Shown:
        """What people read of it."""
        return Shown()

    def said(self, answer: CaseAnswer[Chosen, Result]) -> Said | None:
        """What a command tells beside the file; None: nothing."""
        return None


def see(study: Study, case: int, view: CaseView[Any, Any, Any], chosen: Any, start: int | None) -> CaseAnswer[Any, Any]:
    """Compute the view of a case, or of one of its starts. For a process that computes."""
    return CaseAnswer(study, case, chosen, view.compute(*motion_of(study, case, start), chosen))


def written(view: CaseView[Any, Any, Any], answer: CaseAnswer[Any, Any], form: Literal["json", "csv"]) -> bytes:
    """The view in one of its two forms for programs."""
    return view.csv(answer) if form == "csv" else to_bytes(view.json(answer))


def case_file(
    study: Study, case: int, view: CaseView[Any, Any, Any], chosen: Any, form: Literal["json", "csv"], start: int | None
) -> bytes:
    """Compute the view of a case and write it there, because large ones take seconds to write."""
    return written(view, see(study, case, view, chosen, start), form)


def drawn(view: CaseView[Any, Any, Any], answer: CaseAnswer[Any, Any], form: Picture) -> bytes:
    """The view as a picture, in SI units."""
    figure = read_figure(view.figure(answer), Reading(answer.study.model))
    return draw_figure(figure, f"{answer.study.name}, case {answer.case}", form)
