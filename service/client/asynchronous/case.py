"""One case of a study: its row, and the motions that are computed again for it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from sprag.service.client.asynchronous.part import AsyncStudyPart
from sprag.service.client.motions import Engagements, Motion
from sprag.service.client.queries import basin_query, branch_query, given, transient_query
from sprag.service.client.wire import case_path

if TYPE_CHECKING:
    from sprag.service.answers.results import BasinData, Branch, CaseDetail, Portrait, RegimeRow
    from sprag.service.answers.sections import Sections
    from sprag.service.answers.transients import Transient
    from sprag.service.client.queries import Ends, Value
    from sprag.service.client.wire import Query


class AsyncStudyCases(AsyncStudyPart):
    """Those methods of a study that are about one case.

    ``start`` is the number of one of the starts of a case with many; by default 0, its own.
    """

    async def _of_case(self, case: int, part: str = "", query: Query = ()) -> dict[str, Any]:
        return await self._client.request("GET", case_path(self.id, case, part), params=list(query))

    async def case(self, case: int) -> CaseDetail:
        """One case: parameters, ending, flags, results; "pending" while it has not been run."""
        return cast("CaseDetail", await self._of_case(case))

    async def trajectory(
        self,
        case: int,
        begin: Value | None = None,
        end: Value | None = None,
        *,
        points: int | None = None,
        start: int | None = None,
    ) -> Motion:
        """Every variable, torque, power and state of one case over time, of a machine shaft over the angle.

        Parameters
        ----------
        case : int
        begin, end : float or str, optional
            First and last time (s, or a text with a unit, such as "2 periods") or angle; by default the whole run, of a
            settled study its end.
        points : int, optional
            Equally spaced times or angles.
        start : int, optional
        """
        query = given({"from": begin, "to": end, "points": points, "start": start})
        return Motion(cast("Any", await self._of_case(case, "/trajectory", query)))

    async def regimes(self, case: int) -> list[RegimeRow]:
        """The regimes to which the starts of a case come, the most frequent one first; [] of a case with one start.

        Their results have the share of the starts and its interval, and "regime.start", a start that comes to it.
        """
        return cast("list[RegimeRow]", (await self._of_case(case))["regimes"])

    async def engagements(self, case: int, *, start: int | None = None) -> Engagements:
        """Every engagement of the clutches of one case, and the means of its excitation periods."""
        return Engagements(cast("Any", await self._of_case(case, "/engagements", given({"start": start}))))

    async def strobes(self, case: int, *, start: int | None = None) -> Portrait:
        """The state of one case once per excitation period ("strobes"), and its "orbit" if it has one."""
        return cast("Portrait", await self._of_case(case, "/strobes", given({"start": start})))

    async def branch(
        self, case: int, along: str, low: Value | None = None, high: Value | None = None, *, start: int | None = None
    ) -> Branch:
        """The branch of periodic motions through that of one case, stable and unstable, with its special points.

        Parameters
        ----------
        case : int
        along : str
            Path of the parameter, such as "shaft.load"; several joined by commas get one value.
        low, high : float or str, optional
            Range of the parameter, SI numbers or texts with a unit; by default the ends of its axis.
        start : int, optional
        """
        return cast("Branch", await self._of_case(case, "/branch", branch_query(along, low, high, start=start)))

    async def diagram(
        self,
        case: int,
        along: str,
        low: Value | None = None,
        high: Value | None = None,
        *,
        phase: Value | None = None,
        points: int | None = None,
        strobes: int | None = None,
        start: int | None = None,
    ) -> Sections:
        """The bifurcation diagram of one case: strobes of its settled motions at ``points`` values of a parameter.

        ``along``, ``low`` and ``high`` are as of `branch`; ``phase`` is that of the excitation, in rad or a text with a
        unit; ``strobes`` is the most for each motion.
        """
        query = branch_query(along, low, high, phase=phase, points=points, strobes=strobes, start=start)
        return cast("Sections", await self._of_case(case, "/diagram", query))

    async def section(
        self, case: int, phase: Value | None = None, strobes: int | None = None, *, start: int | None = None
    ) -> Sections:
        """The Poincare section of one case: strobes of its settled motion at a phase of the excitation."""
        query = given({"phase": phase, "strobes": strobes, "start": start})
        return cast("Sections", await self._of_case(case, "/section", query))

    async def basin(
        self,
        case: int,
        x: str | None = None,
        y: str | None = None,
        *,
        x_range: Ends | None = None,
        y_range: Ends | None = None,
        points: int | None = None,
    ) -> BasinData:
        """The regime to which one case comes from each start of a grid of two initial values.

        Parameters
        ----------
        case : int
        x, y : str, optional
            Paths of initial values, such as "shaft.initial_speed"; by default the first two of the study's starts.
        x_range, y_range : tuple of two float or str, optional
            Their ends, SI numbers or texts with a unit; by default those of the starts.
        points : int, optional
            Values of each.
        """
        return cast("BasinData", await self._of_case(case, "/basin", basin_query(x, y, x_range, y_range, points)))

    async def transient(
        self,
        case: int,
        kind: str,
        *,
        load: Value | None = None,
        angle: Value | None = None,
        torque: Value | None = None,
        within: Value | None = None,
        revolutions: Value | None = None,
        points: int | None = None,
    ) -> Transient:
        """The "run-up", a "load-step" or the "coasting" of one machine shaft over time, with its results and cause.

        Parameters
        ----------
        case : int
        kind : str
        load : float or str, optional
            Factor on the torque of all operations during it; a load step needs it.
        angle, torque : float or str, optional
            Angle at the start and driving torque of a run-up, SI numbers or texts with a unit.
        within : float or str, optional
            Share of the first difference in speed at which the steady cycle counts as reached.
        revolutions : float or str, optional
            Most revolutions that are computed.
        points : int, optional
            Equally spaced times.
        """
        query = transient_query(
            kind, points, load=load, angle=angle, torque=torque, within=within, revolutions=revolutions
        )
        return cast("Transient", await self._of_case(case, "/transient", query))
