"""What a study answers: curves, maps, selections, sensitivities, ribbons and yields, calibrations, designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from sprag.service.client.batches import Ribbon, Yield
from sprag.service.client.frames import Curves
from sprag.service.client.queries import (
    answers_query,
    curve_query,
    explore_query,
    front_query,
    result_query,
    ribbon_query,
    yield_query,
)
from sprag.service.client.synchronous.part import StudyPart

if TYPE_CHECKING:
    from sprag.service.answers.calibration import CalibrationReport
    from sprag.service.answers.explore import Exploration
    from sprag.service.answers.goals import FrontReport
    from sprag.service.answers.key import AnswerReport
    from sprag.service.answers.results import Map, SensitivityReport
    from sprag.service.answers.studies import Round
    from sprag.service.client.queries import Value


class StudyAnswers(StudyPart):
    """Those methods of a study that read off its results. Numbers are SI."""

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
        return Curves(cast("Any", self._get("/curves", curve_query(x, y, by, at, number, of))))

    def answers(
        self,
        point: Value | None = None,
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Mapping[str, Value] | None = None,
        of: Mapping[str, Sequence[Value]] | None = None,
    ) -> AnswerReport:
        """The main answers of a study, such as no-load speed, largest power, best efficiency and stall torque.

        Parameters
        ----------
        point : float or str, optional
            Working point on the axis along the curves, such as "0.3 N*m".
        x, by, at, of : optional
            Other curves than those that the page of the study shows first, as for `curves`.
        """
        return cast("AnswerReport", self._get("/answers", answers_query(point, x, by, at, of)))

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
            A parameter, a result, "case", "ending", "flags" or "regime"; "-" before it: from the largest down.
        limit : int, optional
            Most cases, by default 50.
        show : str or sequence of str
            Quantities of histograms and rows, by default the parameters that vary and the model's own results.
        ending, regime, flag : str, optional
            Only cases of one kind.
        """
        query = explore_query(where, sort, limit, show, ending, regime, flag)
        return cast("Exploration", self._get("/explore", query))

    def map(self, x: str, y: str, z: str, *, at: Mapping[str, Value] | None = None, number: int | None = None) -> Map:
        """One result ``z`` over two axes; ``number`` is that of the regime, as for `curves`."""
        query = [*curve_query(x, y, (), at, number), ("z", z)]
        return cast("Map", self._get("/map", query))

    def sensitivity(self, y: str | Sequence[str]) -> SensitivityReport:
        """Main effects of every axis on results, and shares of their variance."""
        return cast("SensitivityReport", self._get("/sensitivity", result_query(y)))

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
        return Ribbon(cast("Any", self._get("/ribbon", ribbon_query(x, y, by, at, quantiles))))

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
        return Yield(cast("Any", self._get("/yield", yield_query(conditions, x, by, at, worst))))

    def calibration(self) -> CalibrationReport:
        """What a calibration has found: values with their intervals, correlations, residuals, the next point.

        Raises
        ------
        RefusedError
            If the study is not a calibration.
        """
        return cast("CalibrationReport", self._get("/calibration"))

    def front(self, limit: int | None = None, *, exact: bool = False) -> FrontReport:
        """The designs of a study with a goal, the best first, and the history of the search.

        Parameters
        ----------
        limit : int, optional
            Most designs, by default 2,000.
        exact : bool
            Whether designs must meet equalities to 1e-6 to be feasible, instead of within their bands.
        """
        return cast("FrontReport", self._get("/front", front_query(limit, exact)))

    def rounds(self) -> list[Round]:
        """The rounds of a study that chooses its own cases, each with what was known before it; [] of others."""
        return cast("list[Round]", (self._get("/rounds"))["rounds"])
