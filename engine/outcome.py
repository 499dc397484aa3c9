"""Results that all models return: those of a batch of cases, and the instantaneous values of one case."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.endings import Ending


@dataclass(frozen=True, slots=True)
class Batch:
    """Results of a batch.

    Attributes
    ----------
    values : float64 array, shape (cases, results)
        In the order of the model's catalogue of results; NaN where a value could not be computed.
    endings : int8 array, shape (cases,)
        Index into `sprag_study.engine.endings.ENDINGS`.
    """

    values: NDArray[np.float64]
    endings: NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Instantaneous values of one case.

    Attributes
    ----------
    times : float64 array, shape (points,)
        Times, or angles of the shaft, according to ``along``, in SI units. Only reached ones: all requested ones unless
        the case ended early, none where it has no motion.
    names, units : tuples, length V
        Name and SI unit of each variable.
    values : float64 array, shape (points, V)
    states : dict
        States of parts of the machine by name, each of length points.
    ending : Ending
    along, unit : str
        "time" in "s", or "angle" in "rad".
    phi_c : tuple of float
        Angles (rad) at which the energy of a machine shaft is its mean.
    """

    times: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: NDArray[np.float64]
    states: dict[str, list[str]]
    ending: Ending
    along: str = "time"
    unit: str = "s"
    phi_c: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Portrait:
    """How one case approaches its motion: its states at the strobes, one excitation period apart, and the orbit.

    Attributes
    ----------
    regime : str
        Name of the settled motion's regime; "" for a run of a given time.
    order : int
        Excitation periods in one turn of the orbit; 0 where there is none.
    strobes : Trajectory
        From the start (of a long run, the last ones): shaft's speed, pendulums' angles, speeds and windups, states.
    orbit : Trajectory
        Whole turns of the settled motion, equally spaced, the first point again at the end; no points where there is
        no orbit. Its times count from the start of an excitation period.
    points : int
        Points of the orbit per excitation period; every such number of points there is a strobe.
    ending : Ending
        Of the run to the settled motion, or of the given time.
    """

    regime: str
    order: int
    strobes: Trajectory
    orbit: Trajectory
    points: int
    ending: Ending


@dataclass(frozen=True, slots=True)
class Basin:
    """The regimes to which one case comes from a grid of starts.

    Attributes
    ----------
    x, y : float64 arrays, shapes (k,) and (m,)
        Initial values (SI) of two parameters.
    members : int64 array, shape (m, k)
        Number of the regime to which each start comes; -1 where it did not end ok.
    names : tuple of str
    values : float64 array, shape (regimes, results)
        Results ``names`` of each regime, the most frequent first.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    members: NDArray[np.int64]
    names: tuple[str, ...]
    values: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Engagement:
    """One stretch in which a clutch transmits torque.

    Attributes
    ----------
    clutch : int
        Number of its pendulum, from 0.
    start, end : float
        Times in s.
    order : int
        1 for a clutch that begins while no other transmits torque, 2 for one that joins another, and so on.
    torque_max : float
        Largest torque, in N*m.
    work_shaft, work_pendulum : float
        Work in J that the clutch does on the shaft, and that its pendulum does on the clutch.
    complete : bool
        Whether it begins and ends within the examined part of the run; otherwise only its part within is given.
    impact_speed : float
        Relative speed of pendulum and shaft at its start, in rad/s; NaN where it begins before the examined part.
    torque_rate_max : float
        Largest rate of the torque in magnitude between its jumps, in N*m/s.
    windup_max : float
        Largest windup, in rad.
    """

    clutch: int
    start: float
    end: float
    order: int
    torque_max: float
    work_shaft: float
    work_pendulum: float
    complete: bool
    impact_speed: float
    torque_rate_max: float
    windup_max: float


@dataclass(frozen=True, slots=True)
class PeriodMeans:
    """One excitation period of a run.

    Attributes
    ----------
    start : float
        Time in s.
    speed_mean, speed_max : float
        Of the shaft, in rad/s.
    torque_mean : float
        Of all clutches on the shaft, in N*m.
    """

    start: float
    speed_mean: float
    speed_max: float
    torque_mean: float


@dataclass(frozen=True, slots=True)
class Engagements:
    """The engagements of one case, in order.

    Attributes
    ----------
    start, end : float
        The examined part of the run, in s.
    regime : str
        Name of the settled motion's regime; "" for a run of a given time.
    rows : tuple of Engagement
        In order of their starts.
    periods : tuple of PeriodMeans
        Whole excitation periods, in order.
    ending : Ending
        Where it is not ok there are no rows and no periods.
    """

    start: float
    end: float
    regime: str
    rows: tuple[Engagement, ...]
    periods: tuple[PeriodMeans, ...]
    ending: Ending


@dataclass(frozen=True, slots=True)
class Forces:
    """The forces of one case.

    Attributes
    ----------
    start, end : float
        The examined part of the run, in s.
    regime : str
        Name of the settled motion's regime; "" for a run of a given time.
    infos : tuple of ResultInfo
        Its results; none where the ending is not ok.
    results : dict
        The results by name, SI; NaN where a value does not exist.
    motion : Trajectory
        The forces over time.
    ending : Ending
    """

    start: float
    end: float
    regime: str
    infos: tuple[ResultInfo, ...]
    results: dict[str, float]
    motion: Trajectory
    ending: Ending


@dataclass(frozen=True, slots=True)
class ClutchDuty:
    """What one clutch has to bear.

    Attributes
    ----------
    clutch : int
        Number of its pendulum, from 0.
    engagements_per_hour : float
    torque_max : float
        Largest torque that it transmits, in N*m.
    torque_rate_max : float
        Largest rate of that torque in magnitude between its jumps, in N*m/s.
    torque_jump_max : float
        Largest jump of that torque, in N*m.
    impact_speed_max : float
        Largest relative speed of pendulum and shaft at the start of an engagement, in rad/s.
    overrunning_speed_max : float
        Largest relative speed at which it overruns, in rad/s.
    windup_min, windup_max : float
        Range of its windup while it transmits torque, in rad.
    slip_work_per_hour : float
        Work that it turns into heat in an hour, in J: by its damping, by its drag while it overruns, and the energy
        of its spring where it opens wound up.
    cycles_per_hour : float
        Cycles of its torque by rainflow counting.
    torque_equivalent : float
        Torque that, reached from zero and left again once in each engagement, does the same damage, in N*m. NaN without
        an exponent of the Wöhler curve, and for a clutch that does not engage.
    torque_margin, frequency_margin, speed_margin : float
        Rated torque over the largest torque, rated indexing frequency over engagements per time, rated overrunning
        speed over the largest one. NaN without a rating, and without a load.
    """

    clutch: int
    engagements_per_hour: float
    torque_max: float
    torque_rate_max: float
    torque_jump_max: float
    impact_speed_max: float
    overrunning_speed_max: float
    windup_min: float
    windup_max: float
    slip_work_per_hour: float
    cycles_per_hour: float
    torque_equivalent: float
    torque_margin: float
    frequency_margin: float
    speed_margin: float


@dataclass(frozen=True, slots=True)
class TorqueCycles:
    """Cycles of the torque of one clutch that are alike.

    Attributes
    ----------
    clutch : int
        Number of its pendulum, from 0.
    range, mean : float
        Difference between peak and valley, and the mean of both, in N*m.
    count : float
        Cycles in the examined part; a half cycle counts as 0.5.
    per_hour : float
        Cycles per hour.
    """

    clutch: int
    range: float
    mean: float
    count: float
    per_hour: float


@dataclass(frozen=True, slots=True)
class Duty:
    """What the clutches of one case have to bear.

    Attributes
    ----------
    start, end : float
        The examined part of the run, in s.
    regime : str
        Name of the settled motion's regime; "" for a run of a given time.
    rows : tuple of ClutchDuty
        One for each clutch; () where none transmits torque in the limit of a vanishing load.
    cycles : tuple of TorqueCycles
        Of each clutch, the largest ranges first.
    ending : Ending
        Where it is not ok there are no rows and no cycles.
    """

    start: float
    end: float
    regime: str
    rows: tuple[ClutchDuty, ...]
    cycles: tuple[TorqueCycles, ...]
    ending: Ending
