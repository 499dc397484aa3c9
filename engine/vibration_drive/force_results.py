"""The results of the forces of a vibration drive: names, units, meaning, and what they need beside the model
(docs/theory.md, "Forces").
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.vibration_drive.cases import default_of

_DIRECTIONS = {"x": "to the right", "y": "upward"}


def _body(name: str, what: str) -> tuple[ResultInfo, ...]:
    infos = []
    for direction, way in _DIRECTIONS.items():
        own = f"{name}.force_{direction}"
        infos += [
            ResultInfo(f"{own}.mean", "N", f"mean force {what}, {way}"),
            ResultInfo(f"{own}.min", "N", f"smallest (most negative) force {what}, {way}"),
            ResultInfo(f"{own}.max", "N", f"largest force {what}, {way}"),
            ResultInfo(f"{own}.rms", "N", f"root mean square of the force {what}, {way}"),
        ]
    return (
        *infos,
        ResultInfo(f"{name}.force.max", "N", f"largest magnitude of the force {what}"),
        ResultInfo(f"{name}.force.rms", "N", f"root mean square of the magnitude of the force {what}"),
    )


_SHAFT = (
    ResultInfo("excitation.power_x.mean", "W", "mean power that the horizontal vibration gives"),
    ResultInfo("excitation.power_x.max", "W", "largest power that the horizontal vibration gives"),
    ResultInfo("excitation.power_y.mean", "W", "mean power that the vertical vibration gives"),
    ResultInfo("excitation.power_y.max", "W", "largest power that the vertical vibration gives"),
    ResultInfo("bearing.load.mean", "N", "magnitude of the mean load of the bearing of the shaft"),
    ResultInfo(
        "bearing.load.direction", "rad", "direction of the mean load of the bearing, counter-clockwise from the right"
    ),
    ResultInfo("bearing.load.max", "N", "largest load of the bearing"),
    ResultInfo("bearing.load.rms", "N", "root mean square of the load of the bearing"),
    ResultInfo(
        "bearing.equivalent_load", "N", "dynamic equivalent load of the bearing, a mean over the turn of the shaft"
    ),
    ResultInfo(
        "bearing.rating_life.revolutions",
        "1",
        "basic rating life of the bearing in revolutions, which 90 % of such bearings reach",
    ),
    ResultInfo("bearing.rating_life.time", "s", "basic rating life of the bearing at the mean speed of the shaft"),
    ResultInfo("balance.force", "1", "residual of the force balance / largest force of a pendulum"),
)


def _pendulum(index: int) -> tuple[ResultInfo, ...]:
    own = f"pendulums.{index}"
    return (
        *_body(own, "of the pendulum on the table"),
        ResultInfo(f"{own}.spring.force.min", "N", "smallest (most negative) force of its spring"),
        ResultInfo(f"{own}.spring.force.max", "N", "largest force of its spring"),
        ResultInfo(f"{own}.spring.moment.min", "N*m", "smallest (most negative) moment of its spring about the axis"),
        ResultInfo(f"{own}.spring.moment.max", "N*m", "largest moment of its spring about the axis"),
    )


def force_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of the forces of a drive with ``pendulums`` pendulums."""
    infos = (*_body("table", "of all pendulums and of the shaft on the table"), *_SHAFT)
    for index in range(pendulums):
        infos += _pendulum(index)
    return infos


@dataclass(frozen=True, slots=True)
class Bearing:
    """What the bearings of the output shaft need beside the model.

    Attributes
    ----------
    rating : float
        Basic dynamic radial load rating C in N; NaN where it is not known.
    exponent : float
        Of the life: 3 for ball bearings, 10/3 for roller bearings.
    share : float
        Part of the load of all bearings that the bearing with the largest load carries.
    shaft_mass : float
        Mass in kg of the shaft and of what is fixed to it, centred on its axis.
    """

    rating: float = math.nan
    exponent: float = 3.0
    share: float = 1.0
    shaft_mass: float = 0.0

    @classmethod
    def of(cls, values: Mapping[str, float]) -> "Bearing":
        """What the parameters of a case say."""
        rating, exponent, share, mass = (
            float(values.get(path, default_of(path) or 0.0))
            for path in ("shaft.bearing_rating", "shaft.bearing_exponent", "shaft.bearing_share", "shaft.rotor_mass")
        )
        return cls(rating if math.isfinite(rating) else math.nan, exponent, share, mass)
