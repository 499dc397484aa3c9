"""The client for scripts and notebooks: submit a study, wait for it, get its curves and tables."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from sprag.service.client.batches import Ribbon, Yield
from sprag.service.client.cases import CaseAnswers
from sprag.service.client.frames import Curves, grid_of, table_of
from sprag.service.client.plain import ServiceClient
from sprag.service.client.queries import (
    Progressing,
    Value,
    answers_query,
    case_query,
    curve_query,
    explore_query,
    extension,
    finish_text,
    form_of,
    front_query,
    narrow_query,
    reporting,
    result_query,
    ribbon_query,
    spec_of,
    yield_query,
)
from sprag.service.client.waiting import Waiting, wait_for

if TYPE_CHECKING:
    from datetime import datetime
    from os import PathLike

    import httpx
    import pandas as pd
    import xarray as xr

    from sprag.service.answers.calibration import CalibrationReport
    from sprag.service.answers.explore import Exploration
    from sprag.service.answers.goals import FrontReport
    from sprag.service.answers.key import AnswerReport
    from sprag.service.answers.results import Case
    from sprag.service.answers.studies import Preview, StudyDetail, StudySummary
    from sprag.service.client.queries import Spec
    from sprag.service.client.wire import Query

DEFAULT_SERVER = "http://127.0.0.1:8000"


class Client:
    """A connection to a running service; a context manager.

    Parameters
    ----------
    server : str, optional
        Its address; by default that in ``SPRAG_SERVER``, else ``http://127.0.0.1:8000``.
    token : str, optional
        Its token; by default that in ``SPRAG_TOKEN``.
    transport : httpx.BaseTransport, optional
        Replaces the network, for instance in tests.

    Every method may raise `UnreachableError` when no service answers, and `RefusedError`, whose ``errors`` list each
    fault with its field, value and allowed range.
    """

    def __init__(
        self, server: str | None = None, token: str | None = None, *, transport: httpx.BaseTransport | None = None
    ) -> None:
        address = server or os.environ.get("SPRAG_SERVER") or DEFAULT_SERVER
        self.plain = ServiceClient(address, token or os.environ.get("SPRAG_TOKEN"), transport=transport)

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self.plain.__exit__()

    def preview(self, spec: Spec | str | PathLike[str]) -> Preview:
        """Preview of a study: cases, how many of them can be reused, time, size, warnings."""
        return cast("Preview", self.plain.preview(spec_of(spec)))

    def submit(
        self,
        spec: Spec | str | PathLike[str],
        *,
        key: str | None = None,
        priority: int = 0,
        fresh: bool = False,
        finish_by: str | datetime | None = None,
    ) -> Study:
        """Submit a study: a spec, or the name of a JSON or TOML file with one.

        The same ``key`` submits it once, however often it is sent. A ``fresh`` study runs every case, even those that
        other studies have. With ``finish_by``, an aware time or a duration such as "8 h", it is run coarse to fine and
        held then.
        """
        finish = None if finish_by is None else finish_text(finish_by)
        return Study(self, self.plain.create_study(spec_of(spec), key, priority, fresh, finish)["id"])

    def study(self, study_id: str) -> Study:
        """A study by its id; RefusedError when there is none."""
        return Study(self, self.plain.study(study_id)["id"])

    def studies(self, state: str | None = None) -> Iterator[StudySummary]:
        """Every study, newest first, or those in one state."""
        return cast("Iterator[StudySummary]", self.plain.studies([("state", state)] if state else []))


class Study(CaseAnswers):
    """One study of the service. ``id`` is its public name."""

    def __init__(self, client: Client, study_id: str) -> None:
        self._client = client
        self.id = study_id

    def __repr__(self) -> str:
        return f"Study({self.id!r})"

    def detail(self) -> StudyDetail:
        """The current study, with its progress and its spec."""
        return cast("StudyDetail", self._client.plain.study(self.id))

    def wait(self, *, progress: bool | Progressing = False, timeout: float | None = None) -> Study:
        """Wait until the study has ended or reached its deadline; returns the study itself.

        While the service does not answer, for instance during a restart, waiting continues with a warning in the log
        (``sprag.service.client.waiting``).

        Parameters
        ----------
        progress : bool or callable
            True shows a bar on standard error; a function is called with the study from time to time.
        timeout : float, optional
            Seconds after which StudyTimeoutError is raised; the study continues. NaN raises ValueError.
        """
        with reporting(progress) as tell:
            wait_for(self._client.plain, self.id, Waiting(tell, timeout))
        return self

    def curves(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        number: int | None = None,
        of: Mapping[str, Sequence[Value]] | None = None,
    ) -> Curves:
        """Results ``y`` against axis ``x``, a curve for each value of the axes ``by``, others held ``at`` values.

        ``of`` gives, by path, those values of the axes ``by`` that have a curve; by default all of them.
        ``number`` is that of the regime in cases with many starts, by default 0, the most frequent one. Without ``x``
        or ``y``, the curves that the page of the study shows first.
        """
        return Curves(cast("Any", self._client.plain.drawn(self.id, "curves", curve_query(x, y, by, at, number, of))))

    def answers(
        self,
        point: Value | None = None,
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        of: Mapping[str, Sequence[Value]] | None = None,
    ) -> AnswerReport:
        """What one asks of a study first, such as no-load speed, largest power, best efficiency and stall torque.

        Parameters
        ----------
        point : float or str, optional
            Working point on the axis along the curves, such as "0.3 N*m".
        x, by, at, of : optional
            Other curves than those that the page of the study shows first, as for `curves`.
        """
        return cast("AnswerReport", self._client.plain.answers(self.id, answers_query(point, x, by, at, of)))

    def explore(
        self,
        where: str | Sequence[str] = (),
        *,
        sort: str | None = None,
        limit: int | None = None,
        show: str | Sequence[str] = (),
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
    ) -> Exploration:
        """The cases of which all ranges ``where`` hold, such as "shaft.load <= 2 N*m", the first ``limit`` in order.

        Parameters
        ----------
        where : str or sequence of str
        sort : str, optional
            A parameter or a result, with "-" before it from the largest down.
        limit : int, optional
            Most cases, by default 50.
        show : str or sequence of str
            Quantities of histograms and rows, by default the parameters that vary and the model's own results.
        ending, regime, flag : str, optional
            Only cases of one kind.
        """
        query = explore_query(where, sort, limit, show, ending, regime, flag)
        return cast("Exploration", self._client.plain.explore(self.id, query))

    def map(
        self, x: str, y: str, z: str, *, at: Mapping[str, Value] | None = None, number: int | None = None
    ) -> dict[str, Any]:
        """One result ``z`` over two axes; ``number`` is that of the regime, as for `curves`."""
        query = [*curve_query(x, y, (), at, number), ("z", z)]
        return self._client.plain.drawn(self.id, "map", query)

    def sensitivity(self, y: str | Sequence[str]) -> dict[str, Any]:
        """Main effects of every axis on results, and shares of their variance."""
        return self._client.plain.drawn(self.id, "sensitivity", result_query(y))

    def ribbon(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        quantiles: Sequence[float] = (),
    ) -> Ribbon:
        """Quantiles of results over the drives of a study with tolerances, along axis ``x``, as `curves` takes them.

        ``quantiles`` are probabilities, by default 0.05, 0.5 and 0.95.
        """
        return Ribbon(cast("Any", self._client.plain.drawn(self.id, "ribbon", ribbon_query(x, y, by, at, quantiles))))

    def yields(
        self,
        conditions: str | Sequence[str],
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        worst: int | None = None,
    ) -> Yield:
        """The share of drives that reach all ``conditions``, such as "shaft.speed.mean >= 90 % of nominal".

        At each place along axis ``x`` and at all of them, with the tolerances that it is owed to and the ``worst``
        drives (by default 10).
        """
        return Yield(cast("Any", self._client.plain.drawn(self.id, "yield", yield_query(conditions, x, by, at, worst))))

    def calibration(self) -> CalibrationReport:
        """What a calibration has found: values with their intervals, correlations, residuals, the next point.

        Raises
        ------
        RefusedError
            If the study is not a calibration.
        """
        return cast("CalibrationReport", self._client.plain.calibration(self.id))

    def front(self, limit: int | None = None, *, exact: bool = False) -> FrontReport:
        """The designs of a study with a goal, the best first, and the history of the search.

        Parameters
        ----------
        limit : int, optional
            Most designs, by default 2,000.
        exact : bool
            Whether designs must meet equalities to 1e-6 to be feasible, instead of within their bands.
        """
        return cast("FrontReport", self._client.plain.front(self.id, front_query(limit, exact)))

    def _of_case(self, case: int, part: str = "", query: Query = ()) -> dict[str, Any]:
        return self._client.plain.of_case(self.id, case, part, query)

    def cases(self, *, ending: str | None = None, regime: str | None = None, flag: str | None = None) -> Iterator[Case]:
        """Every finished case in order of the numbers, or those with an ending, a regime and a flag only."""
        return cast("Iterator[Case]", self._client.plain.cases(self.id, case_query(ending, regime, flag)))

    def table(self) -> pd.DataFrame:
        """All rows with all results as a pandas table, NaN for missing values."""
        return table_of(self.download("parquet"))

    def grid(self) -> xr.Dataset:
        """All rows as an xarray grid whose dimensions are the axes, with units as attributes."""
        return grid_of(self.download("netcdf"))

    def download(self, form: str) -> bytes:
        """All rows in a format of `sprag.service.results.exports`, or the report as "html" or "pdf"."""
        return b"".join(self._pieces(form))

    def export(self, file: str | PathLike[str], form: str | None = None) -> Path:
        """Write all rows, or a report, to a file; its ending determines the format unless ``form`` is given."""
        path = Path(file)
        pieces = self._pieces(form or form_of(path))
        first = next(pieces, b"")  # a refusal is raised here and leaves an existing file unchanged
        with path.open("wb") as out:
            out.write(first)
            for piece in pieces:
                out.write(piece)
        return path

    def _pieces(self, form: str) -> Iterator[bytes]:
        plain = self._client.plain
        return plain.report(self.id, form) if form in ("html", "pdf") else plain.results(self.id, form)

    def picture(
        self,
        file: str | PathLike[str],
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
    ) -> Path:
        """Write curves as a picture: .svg, .png or .pdf."""
        path = Path(file)
        pieces = self._client.plain.picture(self.id, "curves", curve_query(x, y, by, at), path.suffix[1:].lower())
        path.write_bytes(b"".join(pieces))
        return path

    def extend(
        self,
        axes: Sequence[Mapping[str, Any]] | None = None,
        *,
        cases: Sequence[Mapping[str, Any]] | None = None,
        name: str | None = None,
        key: str | None = None,
    ) -> Study:
        """Submit a study with this one's cases and more, of which only the new ones are run.

        The same ``key`` submits it once, however often it is sent.
        """
        return Study(self._client, self._client.plain.extend(self.id, extension(axes, cases, name), key)["id"])

    def run_longer(self, regime: str | None = None, at_most: int | None = None, *, key: str | None = None) -> Study:
        """Submit a study of this one's unsettled cases, with more excitation periods for each.

        For a settled study, the cases of a regime, by default the unsettled ones; otherwise those with the flag
        ``not_settled``.
        """
        return Study(self._client, self._client.plain.run_longer(self.id, regime, at_most, key)["id"])

    def narrow(
        self, steps: int | None = None, at: Mapping[str, Value] | None = None, *, key: str | None = None
    ) -> Study:
        """Submit this one's sweep once more, with smaller steps where its motion jumps.

        Each of these steps is split into ``steps`` (16). ``at`` maps paths of other axes to their only values.
        """
        return Study(self._client, self._client.plain.narrow(self.id, narrow_query(steps, at), key)["id"])

    def act(self, verb: str) -> StudySummary:
        """Request "pause", "resume", "cancel" or "retry"."""
        return cast("StudySummary", self._client.plain.act(self.id, verb))
