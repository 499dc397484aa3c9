"""Motions of one case as tables: instantaneous values, engagements, duty of clutches. pandas is loaded on first use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

from sprag_study.service.client.tabular import Tabular
from sprag_study.service.extras import naming_extra

if TYPE_CHECKING:
    import pandas as pd

    from sprag_study.service.answers.results import AngleTable, DutyTables, EngagementTables, Trajectory
    from sprag_study.service.client.sketch import Line

#: SI units of the columns of engagements and of periods.
_ENGAGEMENT_UNITS: Final = {
    "start": "s", "end": "s", "torque_max": "N*m", "work_shaft": "J", "work_pendulum": "J", "impact_speed": "rad/s",
    "torque_rate_max": "N*m/s", "windup_max": "rad",
}  # fmt: skip
_PERIOD_UNITS: Final = {"start": "s", "speed_mean": "rad/s", "speed_max": "rad/s", "torque_mean": "N*m"}
#: Those of what clutches have to bear, and of the cycles of their torques.
_DUTY_UNITS: Final = {
    "torque_max": "N*m", "torque_rate_max": "N*m/s", "torque_jump_max": "N*m", "impact_speed_max": "rad/s",
    "overrunning_speed_max": "rad/s", "windup_min": "rad", "windup_max": "rad", "slip_work_per_hour": "J",
    "torque_equivalent": "N*m",
}  # fmt: skip
_CYCLE_UNITS: Final = {"range": "N*m", "mean": "N*m"}


@dataclass(frozen=True, slots=True, repr=False)
class Motion(Tabular):
    """Instantaneous values of one case over time, or over the angle; ``data`` is the answer of the service."""

    data: Trajectory | AngleTable

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column that has one."""
        axis = self.data["axis"]
        return {axis["name"]: axis["unit"], **{name: info["unit"] for name, info in self.data["variables"].items()}}

    def to_pandas(self) -> pd.DataFrame:
        """A row for each time or angle: every variable, and the states by name; ``attrs`` has units and the ending."""
        with naming_extra("Motion.to_pandas", "tables"):
            import pandas as pd

        states = cast("dict[str, list[str]]", self.data.get("states", {}))
        values = {name: pd.Series(column, dtype="float64") for name, column in self.data["values"].items()}
        table = pd.DataFrame({self.data["axis"]["name"]: self._places(), **values, **states})
        table.attrs.update(units=self.units, ending=self.data["ending"], case=self.data["case"])
        return table

    def _places(self) -> list[float]:
        return cast("dict[str, list[float]]", self.data)[self.data["axis"]["name"]]

    def _lines(self) -> tuple[str, str, list[Line]]:
        name = next((key for key in self.data["values"] if "speed" in key), next(iter(self.data["values"]), ""))
        if not name:
            return "", "", []
        axis, unit = self.data["axis"], self.units[name]
        return f"{axis['name']} in {axis['unit']}", f"{name} in {unit}", [(self._places(), self.data["values"][name])]


@dataclass(frozen=True, slots=True, repr=False)
class Engagements:
    """The engagements of one case, and the means of its periods; ``data`` is the answer of the service. SI units."""

    data: EngagementTables

    def __repr__(self) -> str:
        return f"Engagements(case {self.data['case']}: {len(self.data['engagements'])} engagements)"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each engagement: clutch, start, end, order, torque, work, impact, windup; ``attrs`` has units and
        the ending.
        """
        return _frame(self.data, "engagements", _ENGAGEMENT_UNITS)

    def periods(self) -> pd.DataFrame:
        """A row for each whole excitation period: start, speeds of the shaft, mean torque of all clutches."""
        return _frame(self.data, "periods", _PERIOD_UNITS)


@dataclass(frozen=True, slots=True, repr=False)
class Duty:
    """What the clutches of one case have to bear; ``data`` is the answer of the service. SI units."""

    data: DutyTables

    def __repr__(self) -> str:
        return f"Duty(case {self.data['case']}: {len(self.data['clutches'])} clutches)"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each clutch: torques, impacts, overrunning, windup, slip; ``attrs`` has units and the ending."""
        return _frame(self.data, "clutches", _DUTY_UNITS)

    def cycles(self) -> pd.DataFrame:
        """A row for each kind of cycle of a clutch's torque: its range, mean and count, the largest first."""
        return _frame(self.data, "cycles", _CYCLE_UNITS)


def _frame(data: EngagementTables | DutyTables, part: str, units: dict[str, str]) -> pd.DataFrame:
    with naming_extra("a table of clutches", "tables"):
        import pandas as pd

    table = pd.DataFrame(cast("dict[str, Any]", data)[part])
    table.attrs.update(units=dict(units), ending=data["ending"], case=data["case"])
    return table
