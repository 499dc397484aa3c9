"""The views of a study: what each is asked, how it is found in the rows of the study, and how it is written and drawn.

One description serves the addresses of the API (`sprag_study.service.http.api.study_views`), the pages and the command
line.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, TypeVar

from sprag_study.service.figures.pictures import draw_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.json_text import to_bytes
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.shown import NOTHING, Shown

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.formats import Picture
    from sprag_study.service.reading.reader import Choice, Reading
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.setting import Offered, ViewInfo
    from sprag_study.worker.study import Study

#: Numbers of a view that the service itself reads and writes, in about ten milliseconds; more belong in another
#: process, because they take seconds during which nobody else would be answered.
FEW: Final = 20_000

Question = TypeVar("Question")
Chosen = TypeVar("Chosen")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class StudyAnswer(Generic[Chosen, Result]):
    """A view of a study: of which study, what was chosen, and what was found."""

    library: Library
    study_id: str
    chosen: Chosen
    result: Result

    @property
    def study(self) -> Study:
        """The study."""
        return self.library.store.studies.study(self.study_id)


class StudyView(ABC, Generic[Question, Chosen, Result]):
    """A view of a study.

    Attributes
    ----------
    about : ViewInfo
        Its name, its question, and what it is.
    content : str
        What its files have, a sentence for the API.
    shape : type
        That of its JSON.
    file : str
        The last part of the name of its file, where that is not its name.
    """

    about: ClassVar[ViewInfo]
    content: ClassVar[str]
    shape: ClassVar[Any]
    file: ClassVar[str] = ""

    @property
    def drawn_differs(self) -> bool:
        """Whether a picture shows more than the numbers."""
        return type(self).find_drawn is not StudyView.find_drawn

    def has(self, study: Study) -> bool:
        """Whether a study has it."""
        return True

    def offered(self, study: Study) -> Mapping[str, Offered]:
        """What a study offers for the settings, by alias."""
        return {}

    @abstractmethod
    def choose(self, study: Study, question: Question) -> Chosen:
        """What a question means for a study; FaultError about a setting, or where the study has no such view."""

    def check(self, study: Study, chosen: Chosen) -> None:
        """Refuse what the study has not, before its cases are run; `find` refuses it as well. FaultError."""

    def small(self, study: Study, chosen: Chosen) -> bool:
        """Whether the service itself may find and write it."""
        return False

    @abstractmethod
    def find(self, library: Library, study_id: str, chosen: Chosen) -> Result:
        """Find it in the rows of the study."""

    def find_drawn(self, library: Library, study_id: str, chosen: Chosen) -> Result:
        """Find what a picture shows, where that is more than the numbers."""
        return self.find(library, study_id, chosen)

    @abstractmethod
    def json(self, answer: StudyAnswer[Chosen, Result]) -> Mapping[str, Any]:
        """The view as JSON data."""

    @abstractmethod
    def csv(self, answer: StudyAnswer[Chosen, Result], reading: Reading) -> bytes:
        """The view as a table, in a reader's units where it has columns in them."""

    def shown(self, answer: StudyAnswer[Chosen, Result]) -> Shown:
        """What people read of it."""
        return NOTHING

    def drawn_in(self, answer: StudyAnswer[Chosen, Result], columns: int) -> Figure:
        """The figure where there is something to draw."""
        figure = self.figure(answer, columns)
        assert figure is not None
        return figure

    def figure(self, answer: StudyAnswer[Chosen, Result], columns: int = 2) -> Figure | None:
        """The view as a described figure with so many panels in a row; None where there is nothing to draw."""
        raise NotImplementedError  # those that are pictures of another kind

    def picture(self, answer: StudyAnswer[Chosen, Result], reading: Reading, title: str, form: Picture) -> bytes:
        """The view as a picture; SelectionError where there is more than one can show."""
        return draw_figure(read_figure(self.drawn_in(answer, 2), reading), title, form)


def answer_of(
    library: Library, study_id: str, view: StudyView[Any, Chosen, Result], chosen: Chosen, *, drawn: bool = False
) -> StudyAnswer[Chosen, Result]:
    """Find the view of a study, as numbers or to be ``drawn``."""
    find = view.find_drawn if drawn else view.find
    return StudyAnswer(library, study_id, chosen, find(library, study_id, chosen))


def study_file(
    library: Library, study_id: str, view: StudyView[Any, Any, Any], chosen: Any, choice: Choice, title: str, form: str
) -> bytes:
    """Find the view of a study and write it as JSON, as CSV, or as a picture."""
    return written(view, answer_of(library, study_id, view, chosen, drawn=is_drawn(form)), choice, title, form)


def is_drawn(form: str) -> bool:
    """Whether a format is that of a picture."""
    return form not in ("json", "csv")


def written(
    view: StudyView[Any, Any, Any], answer: StudyAnswer[Any, Any], choice: Choice, title: str, form: str
) -> bytes:
    """The view as JSON, as CSV, or as a picture."""
    if form == "json":
        return to_bytes(view.json(answer))
    reading = reading_of(answer.library.store, answer.study_id, choice)
    return view.csv(answer, reading) if form == "csv" else view.picture(answer, reading, title, form)  # type: ignore[arg-type]
