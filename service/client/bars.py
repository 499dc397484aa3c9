"""Progress of a study that is waited for: a bar on standard error, or in a notebook, which needs no extension."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import StudyDetail


class Progressing(Protocol):
    """Called with a study from time to time."""

    def __call__(self, study: StudyDetail, /) -> None:
        """Receive the current study."""


@contextmanager
def reporting(progress: bool | Progressing | None) -> Iterator[Progressing]:
    """The receiver of progress: a bar for True, in notebooks also for None; none for False; or the given function."""
    if callable(progress):
        yield progress
    elif progress is not False and in_notebook():
        yield _notebook_bar()
    elif progress:
        with _terminal_bar() as update:
            yield update
    else:
        yield lambda _study: None


def in_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    ipython = sys.modules.get("IPython")
    shell = None if ipython is None else ipython.get_ipython()
    return hasattr(shell, "kernel")


def _notebook_bar() -> Progressing:
    """A bar as HTML, which every front end shows and replaces."""
    front: Any = sys.modules["IPython"].display
    shown: list[Any] = []

    def update(study: StudyDetail, /) -> None:
        content = front.HTML(bar_html(study))
        if shown:
            shown[0].update(content)
        else:
            shown.append(front.display(content, display_id=True))

    return update


def bar_html(study: StudyDetail) -> str:
    """The state of a study with a bar of its cases."""
    now = study["progress"]
    name = escape(study["name"] or study["id"])
    state, done, total = escape(study["state"]), now["done"], now["total"]
    return (
        f'<div>{name}: {state} <progress value="{done}" max="{max(total, 1)}"></progress> {done} of {total} cases</div>'
    )


@contextmanager
def _terminal_bar() -> Iterator[Progressing]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("study", total=None)

        def update(study: StudyDetail, /) -> None:
            now = study["progress"]
            bar.update(task, description=f"{study['id']} {study['state']}", completed=now["done"], total=now["total"])

        yield update
