"""Forces in the joints of a slider-crank: of the rod on the crank's pin, and of the ram on its guide.

Newton's equations of ram and rod, with the shaft's speed and acceleration. The crank is balanced, so that the force on
its pin is that of the part on the main bearing, too.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.sliders import Slider

Floats = NDArray[np.float64]


class JointForces(NamedTuple):
    """Forces in N; x is along the ram's line to the far side, y across it, a quarter turn ahead.

    Attributes
    ----------
    pin_x, pin_y : arrays
        Of the rod on the crank's pin.
    guide : array
        Of the ram on its guide, along y.
    """

    pin_x: Floats
    pin_y: Floats
    guide: Floats


def joint_forces(
    values: Mapping[str, Floats], phi: Floats, squares: Floats, acceleration: Floats, push: Floats,
    gravity: Floats, rod_gravity: Floats,
) -> JointForces:  # fmt: skip
    """Forces at angles ``phi`` of the crank.

    Parameters
    ----------
    values : mapping
        Dimensions and masses of the slider-crank.
    phi, squares, acceleration : arrays
        Angle (rad), omega^2 (rad^2/s^2) and angular acceleration (rad/s^2) of the shaft.
    push : array
        Force on the ram along its forward stroke, in N, without its weight.
    gravity, rod_gravity : arrays
        Gravitational acceleration of the ram and of the rod, in m/s^2; 0 where it has no weight.
    """
    length, centre, mass = values["rod"], values["rod_centre"], values["rod_mass"]
    slider = Slider(values["crank"], length, values["offset"], phi)
    x1, y1, x2, y2 = slider.along_rod(centre)
    ram1, ram2 = slider.x_slopes()
    # The forward stroke is against x; where it rises, gravity acts along x.
    along, across = elementary.sin(values["inclination"]), -elementary.cos(values["inclination"])
    rod_x = values["ram_mass"] * (ram2 * squares + ram1 * acceleration - gravity * along) + push
    crank_x = mass * (x2 * squares + x1 * acceleration - rod_gravity * along) + rod_x
    inertial_y = mass * (y2 * squares + y1 * acceleration - rod_gravity * across)
    turning = values["rod_inertia"] * (slider.b2 * squares + slider.b1 * acceleration)
    lever = centre * (slider.cos_b * inertial_y + slider.sin_b * crank_x) + (length - centre) * slider.sin_b * rod_x
    rod_y = (turning - lever) / (length * slider.cos_b)
    ram_weight = values["ram_mass"] * gravity * across
    return JointForces(-crank_x, -(inertial_y + rod_y), rod_y + ram_weight)
