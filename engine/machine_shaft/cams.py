"""Cam and follower: rise, dwell, fall, dwell, by the laws of motion that designers use."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.mechanisms import Body, Mechanism, Motion, Values, number_of, reduced
from sprag_study.engine.machine_shaft.problems import amount
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]
CamLaw = Literal["cycloidal", "polynomial_345"]
_Law = Callable[[Floats], tuple[Floats, Floats, Floats]]


def _cycloidal(u: Floats) -> tuple[Floats, Floats, Floats]:
    turn = 2.0 * np.pi * u
    return u - elementary.sin(turn) / (2.0 * np.pi), 1.0 - elementary.cos(turn), 2.0 * np.pi * elementary.sin(turn)


def _polynomial_345(u: Floats) -> tuple[Floats, Floats, Floats]:
    rest = 1.0 - u
    return (
        u * u * u * (10.0 - 15.0 * u + 6.0 * np.square(u)),
        30.0 * np.square(u * rest),
        60.0 * u * rest * (rest - u),
    )


#: Lift, slope and curvature of a rise from 0 to 1 as the fraction u of its angle goes from 0 to 1.
LAWS: Mapping[CamLaw, _Law] = {"cycloidal": _cycloidal, "polynomial_345": _polynomial_345}


class Cam(Mechanism):
    """A follower in a straight guide that a cam on the shaft raises and lowers once per revolution.

    From the shaft's angle ``start`` it rises by ``lift`` within ``rise_angle``, dwells for ``dwell_angle``, falls
    within ``fall_angle`` and dwells for the rest. The forward stroke is the rise. A spring of ``spring_rate`` and
    ``spring_preload`` holds it to the cam.
    """

    ram_mass = "follower_mass"
    has_singular_positions = False

    def __init__(self, rise: CamLaw, fall: CamLaw) -> None:
        self._rise, self._fall = LAWS[rise], LAWS[fall]

    def motion(self, values: Values, phi: Floats) -> Motion:
        """See Mechanism."""
        rise, dwell, fall = (values[name] for name in ("rise_angle", "dwell_angle", "fall_angle"))
        angle = np.mod(phi - values["start"], 2.0 * np.pi)
        up, up1, up2 = self._rise(np.clip(angle / rise, 0.0, 1.0))
        down, down1, down2 = self._fall(np.clip((angle - rise - dwell) / fall, 0.0, 1.0))
        lift = values["lift"]
        slope = lift * (up1 / rise - down1 / fall)
        zero = np.zeros((1, 1, 1))
        curvature = lift * (up2 / np.square(rise) - down2 / np.square(fall))
        inertia, inertia_slope = reduced(
            [Body(values["follower_mass"], zero, slope, zero, zero, curvature, zero, zero)]
        )
        return Motion(inertia, inertia_slope, lift * (up - down), slope)

    def dead_centres(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism."""
        return values["start"], values["start"] + values["rise_angle"]

    def return_stroke(self, values: Values) -> tuple[Floats, Floats]:
        """See Mechanism; the fall. A dwell is no stroke."""
        return values["start"] + values["rise_angle"] + values["dwell_angle"], values["fall_angle"]

    def breaks(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        top = values["start"] + values["rise_angle"]
        falling = top + values["dwell_angle"]
        return values["start"], top, falling, falling + values["fall_angle"]

    def margin(self, values: Values, phi: Floats) -> Floats:
        """See Mechanism; assembly fails at the end of the revolution if the follower is not down by then."""
        used = values["rise_angle"] + values["dwell_angle"] + values["fall_angle"]
        late = np.where(phi >= 2.0 * np.pi, 2.0 * np.pi - used, 1.0)
        return np.asarray(np.where(late >= -1e-12, 1.0, -1.0))

    def broken_rule(self, values: Values) -> Sentence | None:
        """See Mechanism."""
        rise, dwell, fall = (math.degrees(number_of(values, f"{name}_angle")) for name in ("rise", "dwell", "fall"))
        return Sentence(
            "rise, dwell and fall of the cam take {rise} + {dwell} + {fall} = {together}, more than the {turn} of a "
            "revolution",
            rise=amount(rise),
            dwell=amount(dwell),
            fall=amount(fall),
            together=amount(rise + dwell + fall, "deg"),
            turn=amount(360.0, "deg"),
        )

    def worst_angles(self, values: Values) -> Sequence[Floats]:
        """See Mechanism."""
        return (2.0 * np.pi * np.ones_like(values["lift"]),)
