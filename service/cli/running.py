"""A study run to its end by a command, without a service, with a progress bar on standard error."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from sprag_study.service.cli.console import progress_bar
from sprag_study.service.languages import _

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from datetime import datetime

    from sprag_study.service.jobs.local import LocalRun
    from sprag_study.service.settings import Settings
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.storage.studies.records import Progress


@contextmanager
def run_parsed(
    parsed: ParsedSpec,
    settings: Settings,
    remark: Callable[[Progress], str] | None = None,
    *,
    title: str | None = None,
    db: str | None,
    processes: int | None = None,
    fresh: bool = False,
    finish_by: datetime | None = None,
) -> Iterator[LocalRun]:
    """Run a study as `run_here` does: in the database of ``settings`` where ``db`` is given.

    ``db`` and ``processes`` are the options of the command. ``title`` stands beside the bar, instead of "study", where
    the study has no name; ``remark`` behind it, by default what is known of a study that chooses its own cases.
    """
    from sprag_study.service.jobs.local import pool_size, run_here

    remark = remark or _rounds
    local = settings.executor == "pool"
    most = settings.pool_processes
    with ExitStack() as bar:
        update = bar.enter_context(progress_bar(parsed.study.name or title or _("study")))
        with run_here(
            parsed.spec,
            parsed.study,
            processes=pool_size(parsed.study, most, asked=processes is not None) if local else most,
            database_url=settings.database_url if db is not None else None,
            chunk_cases=settings.chunk_cases,
            chunk_timeout=settings.chunk_timeout,
            warnings=parsed.warnings,
            fresh=fresh,
            finish_by=finish_by,
            setting=settings.executor,
            on_progress=lambda now: update(now.done, now.total, remark(now)),
        ) as done:
            bar.close()  # what is shown now stays
            yield done


def _rounds(now: Progress) -> str:
    from sprag_study.service.results.rounds import sentence

    return sentence(now.rounds, now.state) if now.rounds else ""
