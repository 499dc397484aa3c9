"""``sprag show ID regimes``: the regimes to which one case comes from its many starts, run here."""

from __future__ import annotations

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import show_table, table_words, write_json, wrong_option
from sprag_study.service.cli.files import require_cases
from sprag_study.service.cli.options import CaseOption, KeptIn, PointsFile, TableFiles
from sprag_study.service.cli.remote import study_named
from sprag_study.service.cli.sources import SpecOrStudy
from sprag_study.service.languages import N_, _

#: What is shown of each regime.
_SHOWN = (
    "regime.number", "regime", "regime.order", "regime.share", "regime.share.low", "regime.share.high", "regime.start",
    "shaft.speed.mean",
)  # fmt: skip


def regimes(
    spec: SpecOrStudy,
    case: CaseOption = 0,
    points_file: PointsFile = None,
    tables: TableFiles = None,
    db: KeptIn = None,
) -> None:
    """The regimes to which one case comes from its many starts, with their shares."""
    import numpy as np

    from sprag_study.worker.models import model_results, run_chunk
    from sprag_study.worker.models.starts import has_starts
    from sprag_study.worker.reuse import taken

    study = study_named(spec, points_file, tables, db).study
    require_cases(study, [case])
    if not has_starts(study.run):
        raise wrong_option(
            "/starts",
            "required",
            N_("is required"),
            None,
            allowed=_("`starts` in the spec of a settled study"),
            detail=_("the study has no starts"),
        )
    done = run_chunk(taken(study, np.array([case])) if study.axes else study, 0, 1)
    infos = {info.name: (place, info) for place, info in enumerate(model_results(study))}
    further = () if done.further is None else done.further.values
    rows = [
        {name: infos[name][1].cell(float(row[infos[name][0]])) for name in _SHOWN} for row in (done.values[0], *further)
    ]
    if wants_json():
        write_json({"case": case, "ending": done.endings[0], "regimes": rows})
        return
    with table_words():
        show_table(
            _("Case {case}: {count} starts", case=case, count=study.run["starts"]["count"]),
            [(name.removeprefix("regime."), name != "regime") for name in _SHOWN],
            [tuple(row.values()) for row in rows],
        )
