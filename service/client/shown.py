"""How a study is shown in a notebook."""

from __future__ import annotations

from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

from sprag_study.service.client.bars import bar_html
from sprag_study.service.client.errors import RefusedError, ServiceError

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import StudyDetail
    from sprag_study.service.client.frames import Curves


class AsyncShown:
    """A study that cannot be asked while it is shown: its id only."""


class _Study(Protocol):
    def detail(self) -> StudyDetail: ...

    def curves(self) -> Curves: ...


class Shown:
    """A study that is asked when it is shown: its state, and its first curves once a case is done,
    where anything varies.
    """

    def _repr_html_(self: _Study) -> str:
        try:
            study = self.detail()
            lines = [bar_html(study), f"<div>{escape(_endings(study))}</div>"]
            if study["progress"]["done"]:
                with suppress(RefusedError):  # without axes there are no curves
                    lines.append(self.curves()._repr_html_())
        except ServiceError as error:
            return f"<pre>{escape(repr(self))}: {escape(str(error))}</pre>"
        return "".join(lines)


def _endings(study: Any) -> str:
    return ", ".join(f"{count} {name}" for name, count in study["progress"]["endings"].items())
