"""What a study and its cases show: a method for each view.

Made of the descriptions of the views by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, cast

from sprag_study.service.client.batches import Ribbon, Yield
from sprag_study.service.client.frames import Curves
from sprag_study.service.client.motions import Duty, Engagements, Motion
from sprag_study.service.client.queries import query_of
from sprag_study.service.client.synchronous.part import StudyPart

if TYPE_CHECKING:
    from sprag_study.service.answers.calibration import CalibrationReport
    from sprag_study.service.answers.explore import Exploration
    from sprag_study.service.answers.forces import Forces
    from sprag_study.service.answers.goals import FrontReport
    from sprag_study.service.answers.key import AnswerReport
    from sprag_study.service.answers.results import BasinData, Branch, Map, Portrait, SensitivityReport
    from sprag_study.service.answers.sections import Sections
    from sprag_study.service.answers.speeds import SteadySpeeds
    from sprag_study.service.answers.start_ups import StartUp
    from sprag_study.service.answers.transients import Transient
    from sprag_study.service.client.queries import Ends, Held, Value


class StudyViews(StudyPart):
    """Those methods of a study that show what it has found. Numbers are SI.

    ``start`` is the number of one of the starts of a case with many; by default 0, its own.
    """

    def curves(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
        of: Held | None = None,
        rest: Literal["given", "usual"] | None = None,
        number: int | None = None,
    ) -> Curves:
        """Results against one axis.

        An axis of several values that is neither x nor in `by` needs its value in `at`, or `rest=usual`.

        Without `x` or `y` they are the curves that the page of the study shows first. Refined curves tell their error
        and their jumps.

        Parameters
        ----------
        x : str, optional
            Path of the axis along the curve; default: that of the page.
        y : str or sequence of str, optional
            Result to draw; default: those of the page.
        by : str or sequence of str, optional
            Axis with one curve for each of its values.
        at : mapping of str to float or str, optional
            The value at which another axis is held, SI or with a unit.
        of : mapping of str to float or str, optional
            A value of an axis of `by` that has a curve; default: all of them.
        rest : {'given', 'usual'}, optional
            Axes that are neither drawn nor in `at`: `given` refuses them, `usual` holds them at their usual value, as
            pages do.
        number : int, optional
            Of cases with many starts, the number of the regime; 0 is the most frequent one of each case.
        """
        query = query_of({"x": x, "y": y, "by": by, "at": at, "of": of, "rest": rest, "number": number})
        return Curves(cast("Any", self._get("/curves", query)))

    def map(self, x: str, y: str, z: str, *, at: Held | None = None, number: int | None = None) -> Map:
        """One result over two axes.

        Parameters
        ----------
        x : str
            Path of the axis along the curve.
        y : str
            Path of the other axis.
        z : str
            The result.
        at : mapping of str to float or str, optional
            The value at which another axis is held, SI or with a unit.
        number : int, optional
            Of cases with many starts, the number of the regime; 0 is the most frequent one of each case.
        """
        query = query_of({"x": x, "y": y, "z": z, "at": at, "number": number})
        return cast("Map", self._get("/map", query))

    def sensitivity(self, y: str | Sequence[str]) -> SensitivityReport:
        """Main effects of every axis on results, and shares of their variance (Sobol indices) or elementary effects.

        Parameters
        ----------
        y : str or sequence of str
            Result.
        """
        query = query_of({"y": y})
        return cast("SensitivityReport", self._get("/sensitivity", query))

    def ribbon(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
        quantiles: Sequence[float] = (),
    ) -> Ribbon:
        """Quantiles of results over the drives along an axis, with 95 % intervals, the nominal drive, and the causes.

        Parameters
        ----------
        x : str, optional
            Path of the axis along the lines; default: that of the curves.
        y : str or sequence of str, optional
            Result; default: those of the page.
        by : str or sequence of str, optional
            Axis with one line for each of its values.
        at : mapping of str to float or str, optional
            The value at which another axis is held, SI or with a unit.
        quantiles : sequence of float, optional
            Probability of a quantile; default: 0.05, 0.5 and 0.95.
        """
        query = query_of({"x": x, "y": y, "by": by, "at": at, "quantile": quantiles})
        return Ribbon(cast("Any", self._get("/ribbon", query)))

    def yields(
        self,
        conditions: str | Sequence[str],
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
        worst: int | None = None,
    ) -> Yield:
        """The share of drives that reach conditions, at each place and at all places, its causes, and the worst drives.

        Parameters
        ----------
        conditions : str or sequence of str
            `RESULT >= VALUE`, `<=` or `=`, the value with a unit or as `N % of nominal`: all must hold.
        x : str, optional
            Path of the axis along the lines; default: that of the curves.
        by : str or sequence of str, optional
            Axis with one line for each of its values.
        at : mapping of str to float or str, optional
            The value at which another axis is held, SI or with a unit.
        worst : int, optional
            Most drives in the list of the worst.
        """
        query = query_of({"condition": conditions, "x": x, "by": by, "at": at, "worst": worst})
        return Yield(cast("Any", self._get("/yield", query)))

    def calibration(self) -> CalibrationReport:
        """The results of a calibration: values with intervals, correlations, residuals, the next point to measure."""
        return cast("CalibrationReport", self._get("/calibration"))

    def front(self, limit: int | None = None, *, exact: bool = False) -> FrontReport:
        """The designs of a study with a goal, the best first: variables, goals, limits, ranks, and the search's
        history.

        Parameters
        ----------
        limit : int, optional
            Most designs.
        exact : bool, optional
            Designs must meet equalities of real numbers to 1e-6 to be feasible.
        """
        query = query_of({"limit": limit, "exact": exact})
        return cast("FrontReport", self._get("/front", query))

    def explore(
        self,
        where: str | Sequence[str] = (),
        *,
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
        sort: str | None = None,
        limit: int | None = None,
        show: str | Sequence[str] = (),
    ) -> Exploration:
        """Cases within ranges of parameters and results, sorted over all rows, with a histogram of each quantity.

        Parameters
        ----------
        where : str or sequence of str, optional
            `NAME >= VALUE` or `NAME <= VALUE` of a parameter that varies or a numeric result, SI or with a unit: all
            must hold.
        ending : str, optional
            Only cases with this ending.
        regime : str, optional
            Only cases of this regime, of a settled study.
        flag : str, optional
            Only cases with this flag.
        sort : str, optional
            Parameter, result, "case", "ending", "flags" or "regime" to sort all rows by; "-" before it: from the
            largest down; cases without it come last.
        limit : int, optional
            Most rows.
        show : str or sequence of str, optional
            Quantity of histograms and rows; default: axes and the model's main results.
        """
        query = query_of(
            {
                "where": where,
                "ending": ending,
                "regime": regime,
                "flag": flag,
                "sort": sort,
                "limit": limit,
                "show": show,
            }
        )
        return cast("Exploration", self._get("/explore", query))

    def answers(
        self,
        point: Value | None = None,
        x: str | None = None,
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
        of: Held | None = None,
    ) -> AnswerReport:
        """The main answers of a study: no-load speed, largest power, best efficiency, stall torque, a working point.

        Parameters
        ----------
        point : float or str, optional
            Working point: a value of the axis along the curves, SI or with a unit; between two cases its results are
            interpolated where a line joins these; default: the value of the base.
        x : str, optional
            Path of the axis along the curves; default: that of the page.
        by : str or sequence of str, optional
            Axis with one curve for each of its values.
        at : mapping of str to float or str, optional
            The value at which another axis is held, SI or with a unit.
        of : mapping of str to float or str, optional
            A value of an axis of `by` that has a curve; default: all of them.
        """
        query = query_of({"point": point, "x": x, "by": by, "at": at, "of": of})
        return cast("AnswerReport", self._get("/answers", query))

    def trajectory(
        self,
        case: int,
        begin: Value | None = None,
        end: Value | None = None,
        *,
        points: int | None = None,
        start: int | None = None,
    ) -> Motion:
        """Compute every variable, torque, power and state of one case over time, or over the angle.

        Parameters
        ----------
        begin : float or str, optional
            First time, in s or with a unit (s, periods), or angle, in rad or with a unit; by default 0, of a settled
            study `max_period` periods before the end.
        end : float or str, optional
            Last time or angle, with the same units; by default the end of the run (`at_most` of a settled study) or
            cycle.
        points : int, optional
            Equally spaced times or angles.
        """
        query = query_of({"from": begin, "to": end, "points": points, "start": start})
        return Motion(cast("Any", self._of_case(case, "/trajectory", query)))

    def engagements(self, case: int, *, start: int | None = None) -> Engagements:
        """Compute every engagement of the clutches of one case, and the means of its periods."""
        query = query_of({"start": start})
        return Engagements(cast("Any", self._of_case(case, "/engagements", query)))

    def duty(self, case: int, *, exponent: Value | None = None, start: int | None = None) -> Duty:
        """Compute what the clutches of one case have to bear: cycles of torque, impacts, overrunning, slip.

        Parameters
        ----------
        exponent : float or str, optional
            Exponent of the Wöhler curve of all clutches, for the equivalent torque; by default that of the machine.
        """
        query = query_of({"exponent": exponent, "start": start})
        return Duty(cast("Any", self._of_case(case, "/duty", query)))

    def forces(
        self,
        case: int,
        *,
        shaft_mass: Value | None = None,
        load_rating: Value | None = None,
        bearing: str | None = None,
        share: Value | None = None,
        points: int | None = None,
        start: int | None = None,
    ) -> Forces:
        """Compute the forces of one case on the vibrating table and on the bearings of its shaft, and their rating
        life.

        Parameters
        ----------
        shaft_mass : float or str, optional
            Mass of the shaft and of what is fixed to it, kg or with a unit; by default that of the machine.
        load_rating : float or str, optional
            Basic dynamic load rating C of the bearing, N or with a unit; by default that of the machine.
        bearing : str, optional
            Kind of the bearing, for the exponent of its life; by default the exponent of the machine.
        share : float or str, optional
            Part of the load that the bearing with the largest load carries; by default that of the machine.
        points : int, optional
            Equally spaced times.
        """
        query = query_of(
            {
                "shaft_mass": shaft_mass,
                "load_rating": load_rating,
                "bearing": bearing,
                "share": share,
                "points": points,
                "start": start,
            }
        )
        return cast("Forces", self._of_case(case, "/forces", query))

    def strobes(self, case: int, *, start: int | None = None) -> Portrait:
        """Compute the state of one case at the end of each excitation period, and its orbit."""
        query = query_of({"start": start})
        return cast("Portrait", self._of_case(case, "/strobes", query))

    def branch(
        self, case: int, along: str, low: Value | None = None, high: Value | None = None, *, start: int | None = None
    ) -> Branch:
        """Follow the periodic motion of one case along a parameter: stable and unstable orbits, folds, doublings,
        grazings.

        Parameters
        ----------
        along : str
            Path of the parameter, or several joined by commas that have one value.
        low : float or str, optional
            Start of the range, SI or with a unit; by default the smallest on its axis.
        high : float or str, optional
            End of the range; by default the largest on its axis.
        """
        query = query_of({"along": along, "from": low, "to": high, "start": start})
        return cast("Branch", self._of_case(case, "/branch", query))

    def diagram(
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
        """Compute a bifurcation diagram: the strobes of the settled motions of one case along a parameter.

        Parameters
        ----------
        along : str
            Path of the parameter, or several joined by commas that have one value.
        low : float or str, optional
            Start of the range, SI or with a unit; by default the smallest on its axis.
        high : float or str, optional
            End of the range; by default the largest on its axis.
        phase : float or str, optional
            Phase of the excitation at the strobes, rad or with a unit; by default 0.
        points : int, optional
            Equally spaced values of the parameter.
        strobes : int, optional
            Most strobes of each motion.
        """
        query = query_of(
            {
                "along": along,
                "from": low,
                "to": high,
                "phase": phase,
                "points": points,
                "strobes": strobes,
                "start": start,
            }
        )
        return cast("Sections", self._of_case(case, "/diagram", query))

    def section(
        self, case: int, phase: Value | None = None, strobes: int | None = None, *, start: int | None = None
    ) -> Sections:
        """Compute a Poincare section: the strobes of the settled motion of one case at a phase of the excitation.

        Parameters
        ----------
        phase : float or str, optional
            Phase of the excitation at the strobes, rad or with a unit; by default 0.
        strobes : int, optional
            Most strobes.
        """
        query = query_of({"phase": phase, "strobes": strobes, "start": start})
        return cast("Sections", self._of_case(case, "/section", query))

    def basin(
        self,
        case: int,
        x: str | None = None,
        y: str | None = None,
        *,
        x_range: Ends | None = None,
        y_range: Ends | None = None,
        points: int | None = None,
    ) -> BasinData:
        """Compute a basin: the regime to which one case comes from each start of a grid of two initial values.

        Parameters
        ----------
        x : str, optional
            Initial value across; by default the first one of the study's starts.
        x_range : two float or str, optional
            Its ends, SI or with a unit; by default as in the study's starts.
        y : str, optional
            The other initial value; by default the next one.
        y_range : two float or str, optional
            Its ends, SI or with a unit; by default as in the study's starts.
        points : int, optional
            Values of each.
        """
        query = query_of(
            {
                "x": x,
                "x_from": None if x_range is None else x_range[0],
                "x_to": None if x_range is None else x_range[1],
                "y": y,
                "y_from": None if y_range is None else y_range[0],
                "y_to": None if y_range is None else y_range[1],
                "points": points,
            }
        )
        return cast("BasinData", self._of_case(case, "/basin", query))

    def startup(
        self,
        case: int,
        *,
        ramp: Value | None = None,
        start_frequency: str | None = None,
        load_ramp: Value | None = None,
        within: Value | None = None,
        points: int | None = None,
        start: int | None = None,
    ) -> StartUp:
        """Compute the start-up of one case with ramps of the excitation frequency and of the load: time, energy,
        torques.

        Parameters
        ----------
        ramp : float or str, optional
            Time in which the excitation frequency rises linearly to its value, in s or with a unit (s, periods of the
            final frequency); by default 0.
        start_frequency : str, optional
            Frequency at which that ramp begins, Hz or with a unit; by default 0.
        load_ramp : float or str, optional
            Time in which the load of the shaft rises linearly from nothing, with the same units; by default 0.
        within : float or str, optional
            Share by which a mean speed may differ from the settled one; by default 0.02.
        points : int, optional
            Equally spaced times.
        """
        query = query_of(
            {
                "ramp": ramp,
                "start_frequency": start_frequency,
                "load_ramp": load_ramp,
                "within": within,
                "points": points,
                "start": start,
            }
        )
        return cast("StartUp", self._of_case(case, "/startup", query))

    def speeds(self, case: int, *, load: Value | None = None) -> SteadySpeeds:
        """Compute every steady cycle of a machine shaft: its speed, its multiplier, and from which speeds the shaft
        comes to it.

        Parameters
        ----------
        load : float or str, optional
            Factor on the torque of all operations; by default 1.
        """
        query = query_of({"load": load})
        return cast("SteadySpeeds", self._of_case(case, "/speeds", query))

    def transient(
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
        """Compute the run-up from rest of a machine shaft, a step of its load, or its coasting, over time.

        Parameters
        ----------
        kind : str
            Which transient it is.
        load : float or str, optional
            Factor on the torque of all operations during it; by default 1.
        angle : float or str, optional
            Angle of the shaft at which it begins, rad or with a unit; by default 0.
        torque : float or str, optional
            Constant driving torque of a run-up, N*m or with a unit; required without a motor.
        within : float or str, optional
            Share of the first difference in speed from the steady cycle at which that counts as reached; by default
            0.01 with a motor, otherwise 0.
        revolutions : float or str, optional
            Most revolutions that are computed; by default 1000.
        points : int, optional
            Equally spaced times.
        """
        query = query_of(
            {
                "kind": kind,
                "load": load,
                "angle": angle,
                "torque": torque,
                "within": within,
                "revolutions": revolutions,
                "points": points,
            }
        )
        return cast("Transient", self._of_case(case, "/transient", query))
