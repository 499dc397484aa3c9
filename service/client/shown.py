"""How a study is shown: printed, in a notebook, by its name and its state."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from html import escape
from typing import TYPE_CHECKING, Any, Protocol

from sprag_study.service.client.bars import bar_html
from sprag_study.service.client.errors import RefusedError, ServiceError
from sprag_study.service.client.waiting import ENDED

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import StudyDetail
    from sprag_study.service.client.frames import Curves


class AsyncShown:
    """A study that cannot be asked while it is shown."""

    summary: Mapping[str, Any] | None

    @property
    def state(self) -> str | None:
        """Its state as the service last said it, such as "running" or "finished"; None before."""
        return (self.summary or {}).get("state")

    @property
    def name(self) -> str | None:
        """Its name as the service last said it; None before."""
        return (self.summary or {}).get("name")


class _Study(Protocol):
    def detail(self) -> StudyDetail: ...

    def curves(self) -> Curves: ...


class Shown:
    """A study that is asked when it is shown: its state, and its first curves once a case is done,
    where anything varies.
    """

    @property
    def state(self: _Study) -> str:
        """Its state now, such as "running" or "finished"."""
        return self.detail()["state"]

    @property
    def name(self: _Study) -> str:
        """Its name now."""
        return self.detail()["name"]

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


def shown(study_id: str, summary: Mapping[str, Any] | None) -> str:
    """A study in a line: its id and, where it is known, its name, the number of its cases, and how it ended."""
    known = summary or {}
    parts = [repr(study_id)]
    if known.get("name"):
        parts.append(repr(known["name"]))
    if "cases" in known:
        parts.append(f"{known['cases']:,} cases")
    if known.get("state") in ENDED:
        parts.append(known["state"])
    return ", ".join(parts)


def _endings(study: Any) -> str:
    return ", ".join(f"{count} {name}" for name, count in study["progress"]["endings"].items())
