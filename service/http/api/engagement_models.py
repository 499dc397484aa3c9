"""What the interface answers about the engagements of a case."""

from __future__ import annotations

from pydantic import Field

from sprag.service.http.api.models import Body


class EngagementRow(Body):
    """One stretch in which a clutch transmits torque."""

    clutch: int = Field(description="number of its pendulum, from 0")
    start: float = Field(description="s")
    end: float = Field(description="s")
    order: int = Field(description="1: no other clutch transmits torque when it begins; 2: it joins another; and so on")
    torque_max: float = Field(description="largest torque, N*m")
    work_shaft: float = Field(description="work that the clutch does on the shaft, J")
    work_pendulum: float = Field(description="work that the pendulum does on the clutch, J")
    complete: bool = Field(description="false where it begins before or goes on after the part that is told")


class PeriodRow(Body):
    """One excitation period of a run."""

    start: float = Field(description="s")
    speed_mean: float = Field(description="mean speed of the shaft, rad/s")
    speed_max: float = Field(description="largest speed of the shaft, rad/s")
    torque_mean: float = Field(description="mean torque of all clutches on the shaft, N*m")


class EngagementTables(Body):
    """The engagements of one case, and the means of its excitation periods."""

    case: int
    parameters: dict[str, float]
    start: float = Field(description="start of the part that the engagements are from, s")
    end: float = Field(description="its end, s: after one turn of a periodic motion, or at the end of the window")
    regime: str | None = Field(description="regime of the settled motion; null for a run of a given time")
    engagements: list[EngagementRow]
    periods: list[PeriodRow] = Field(description="whole excitation periods")
    ending: str
