"""``sprag show ID settled``: the settled motions of cases, of a spec or of a study of a service, run here."""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING, Annotated

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import (
    ExitCode,
    piped,
    progress_bar,
    say,
    show_table,
    table_words,
    write_json,
    wrong_option,
)
from sprag_study.service.cli.file_formats import require_csv
from sprag_study.service.cli.files import output, require_cases, to_file
from sprag_study.service.cli.options import CsvDecimal, KeptIn, OutputFile, PointsFile, TableFiles
from sprag_study.service.cli.remote import study_named
from sprag_study.service.cli.sources import SpecOrStudy
from sprag_study.service.json_text import to_bytes
from sprag_study.service.languages import N_, _
from sprag_study.worker.limits import MAX_SETTLED_PERIODS, MIN_SETTLED_PERIODS

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.service.storage.studies.records import RowBlock
    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.study import Study

#: Cases that are settled together: enough to fill the engine, few enough to show progress.
_BATCH = 512


def settle(
    spec: SpecOrStudy,
    case: Annotated[
        list[int] | None,
        typer.Option("--case", min=0, metavar="N", help="Number of a case, from 0; may be repeated. Default: all."),
    ] = None,
    points_file: PointsFile = None,
    tables: TableFiles = None,
    db: KeptIn = None,
    file: OutputFile = None,
    decimal: CsvDecimal = None,
    at_most: Annotated[
        int | None,
        typer.Option(
            min=MIN_SETTLED_PERIODS,
            max=MAX_SETTLED_PERIODS,
            help="Excitation periods after which a search ends; default: the spec's, or 1000.",
        ),
    ] = None,
) -> None:
    """Find the settled motions of cases, with many starts all: regime, order, stability and characteristics."""
    from sprag_study.service.exports import Source, csv_pieces, rows_json
    from sprag_study.service.exports.decimal_commas import with_decimals
    from sprag_study.worker.models import OK, study_results
    from sprag_study.worker.models.starts import count_of

    in_json = wants_json() or (file or "").lower().endswith(".json")
    require_csv(None, decimal, "json" if in_json else "csv")
    study = _settled(study_named(spec, points_file, tables, db).study, at_most)
    cases = _chosen(study, case)
    _require_settling(study, cases)
    with output(file) as write:
        blocks = _blocks(study, cases)
        if in_json:
            write(to_bytes([row for block in blocks for row in rows_json(study, block)]) + b"\n")
        elif len(cases) == 1 and not to_file(file):
            _show(blocks[0], count_of(study.run))
        else:
            pieces = csv_pieces(Source(study, study_results(study), blocks, {}))
            for piece in with_decimals(pieces, decimal):
                write(piece)
    endings = Counter(ending for block in blocks for ending in block.first_rows().endings)
    regimes = Counter(row.results["regime"] for block in blocks for row in block.rows() if row.ending == OK)
    say(", ".join(f"{count} {regime}" for regime, count in regimes.most_common()) or _("no case ended ok"))
    if wants_json() and to_file(file):
        write_json({"file": file, "cases": len(cases), "regimes": dict(regimes), "endings": dict(endings)})
    if set(endings) != {OK}:
        raise typer.Exit(ExitCode.NOT_ALL_OK)


def _settled(study: Study, at_most: int | None) -> Study:
    """The study with settled runs; WrongInputError where its model has no settled motion."""
    from sprag_study.worker.models import VIBRATION_DRIVE, settled_study

    if study.model != VIBRATION_DRIVE:
        message, detail = N_("has no motion that settles"), _("this study cannot be settled")
        raise wrong_option("/model", "wrong-type", message, study.model, allowed=VIBRATION_DRIVE, detail=detail)
    return settled_study(study, at_most)


def _chosen(study: Study, asked: list[int] | None) -> list[int]:
    """The selected cases; WrongInputError for an unknown number."""
    if asked is None:
        return list(range(study.cases))
    require_cases(study, asked)
    return list(dict.fromkeys(asked))


def _require_settling(study: Study, cases: list[int]) -> None:
    """Raise WrongInputError where no motion is looked for to which one of the cases settles."""
    import numpy as np

    from sprag_study.service.views.portrait import SWINGS
    from sprag_study.worker.models.vibration_drive.settled import swings

    if swings({**study.base, **study.columns(np.array(cases, dtype=np.int64))}):
        raise wrong_option("--case", "conflict", SWINGS, detail=_("this study cannot be settled"))


def _blocks(study: Study, cases: list[int]) -> list[RowBlock]:
    """The rows of the cases, run here; those of a case with many starts side by side."""
    import numpy as np

    from sprag_study.worker.models import run_chunk
    from sprag_study.worker.reuse import taken

    if study.sweep is not None:
        return [_of_lines(study, np.array(cases, dtype=np.int64))]
    blocks = []
    with progress_bar(study.name or _("study")) as update:
        for first in range(0, len(cases), _BATCH):
            part = np.array(cases[first : first + _BATCH], dtype=np.int64)
            done = run_chunk(taken(study, part) if study.axes else study, 0, part.size)
            blocks.append(_block(study, part, done))
            update(first + part.size, len(cases), "")
    return blocks


def _block(study: Study, cases: NDArray[np.int64], done: ChunkResult) -> RowBlock:
    """The rows of a run of these cases, in their order: those of a case one after the other."""
    import numpy as np

    from sprag_study.worker.models import OK

    if done.further is None:
        return _rows(study, cases, done.endings, done.flags, done.values)
    places = np.concatenate([np.arange(cases.size), done.further.of])
    order = np.argsort(places, kind="stable")
    endings = [*done.endings, *[OK] * len(done.further.of)]
    flags = [*done.flags, *done.further.flags]
    values = np.concatenate([done.values, done.further.values])
    return _rows(study, cases[places[order]], [endings[k] for k in order], [flags[k] for k in order], values[order])


def _rows(
    study: Study, cases: NDArray[np.int64], endings: list[str], flags: list[str], values: NDArray[np.float64]
) -> RowBlock:
    """Rows with the quantities of their study."""
    from sprag_study.service.storage.studies.records import RowBlock
    from sprag_study.worker.models import model_results, study_results, with_quantities

    values = with_quantities(study, model_results(study), cases, values)
    return RowBlock(study_results(study), cases, endings, flags, values)


def _of_lines(study: Study, cases: NDArray[np.int64]) -> RowBlock:
    """The rows of cases of a sweep: whole lines are run, because every case needs those before it."""
    import numpy as np

    from sprag_study.worker.models import run_chunk
    from sprag_study.worker.reuse import taken
    from sprag_study.worker.sweeps import LineOrder

    order = LineOrder(study)
    every = np.sort(order.cases(order.lines_at(order.positions(cases))))
    done = run_chunk(taken(study, every), 0, every.size)
    rows = np.searchsorted(every, cases)
    endings, flags = ([column[row] for row in rows.tolist()] for column in (done.endings, done.flags))
    return _rows(study, cases, endings, flags, done.values[rows])


def _show(block: RowBlock, starts: int) -> None:
    """One case as a table, without missing values; a column for each of its regimes."""
    from sprag_study.service.reading.reader import shown as said
    from sprag_study.service.results.regimes import ORDER, coasting_sentence, motion_sentence, rotation_sentences
    from sprag_study.worker.models import ENDING_SENTENCES, OK

    first, *others = block.rows()
    regime, order = (first.results[name] for name in ("regime", ORDER))
    settled = motion_sentence(str(regime), order if isinstance(order, int) else None) if first.ending == OK else None
    meaning = said(settled) if settled else _(ENDING_SENTENCES[first.ending])
    if not others:
        meaning = " ".join([meaning, *map(said, rotation_sentences(first.results))])
    if not others and (coasting := coasting_sentence(first.results)) is not None:
        meaning = f"{meaning} {said(coasting)}"
    if others:
        meaning = _("{count} regimes, to which its {starts} starts come", count=len(block), starts=starts)
    title = _("Case {case}: {text}", case=first.case, text=meaning)
    if piped():
        say(title)
    values = zip(block.infos, block.values.T.tolist(), strict=True)
    rows = [
        (info.name, *("" if math.isnan(value) else info.cell(value) for value in own), info.unit)
        for info, own in values
        if piped() or any(map(math.isfinite, own))
    ]
    with table_words():
        heads = [_("regime {number}", number=number) for number in range(len(block))] if others else [_("value")]
        shown = [(head, True) for head in heads]
        show_table(title, [(_("result"), False, True), *shown, (_("unit"), False)], rows)
