"""Flywheels: the drive inertia required for a given irregularity, and rims and discs given by their dimensions."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.results import result_infos
from sprag_study.engine.machine_shaft.roots import bracketed_roots
from sprag_study.engine.machine_shaft.spec import Flywheel as Shapes
from sprag_study.engine.machine_shaft.spec import MeanSpeed
from sprag_study.engine.machine_shaft.start import Shape, Stop, least_mean_speed, mean_speed

Floats = NDArray[np.float64]
#: Steps of Newton's method to the diameter of a ring; a thick one with little inertia takes the most.
_NEWTON = 60


@dataclass(frozen=True, slots=True)
class Flywheel:
    """A flywheel on a shaft of the train; all arrays have the shape (cases or 1, 1, 1).

    A thin rim of the mean diameter D has J = m D^2/4 and the hoop stress rho v^2 with v = omega D/2. A solid disc has
    J = m D^2/8 and, at its centre, the stress (3 + nu)/8 rho v^2 with v at its edge (S. P. Timoshenko, J. N. Goodier,
    *Theory of Elasticity*, section 32). A ring is a rim of the width b and the thickness t about the mean diameter D:
    m = pi rho D b t, J = m (D^2 + t^2)/4, and with s = t/D and v = omega D/2 the largest stress, at its inner edge, is
    rho v^2 ((3 + nu) (1 + s)^2 + (1 - nu) (1 - s)^2)/4 (the same section).

    Attributes
    ----------
    values : mapping
        The numbers by name, with the mass of a ring.
    form : array
        J/(m D^2).
    factor : array
        Stress/(rho v^2).
    ratio : array
        Speed of its shaft over that of the main shaft.
    """

    values: Mapping[str, Floats]
    form: Floats
    factor: Floats
    ratio: Floats

    @classmethod
    def of(cls, shape: Shapes, values: Mapping[str, Floats], ratio: Floats) -> "Flywheel":
        """The flywheel of the ``values`` by path, on a shaft of the ``ratio``."""
        prefix = "drive.flywheel."
        own = {path.removeprefix(prefix): value for path, value in values.items() if path.startswith(prefix)}
        if shape == "ring":
            return cls._ring(own, ratio)
        factor = 1.0 if shape == "rim" else (3.0 + own["poisson_ratio"]) / 8.0
        return cls(own, np.asarray(0.25 if shape == "rim" else 0.125), np.asarray(factor), ratio)

    @classmethod
    def _ring(cls, own: dict[str, Floats], ratio: Floats) -> "Flywheel":
        diameter, thickness, nu = own["diameter"], own["thickness"], own["poisson_ratio"]
        # One that is thicker than its mean diameter has no inner edge.
        thickness = np.where(thickness <= diameter, thickness, np.nan)
        share = thickness / diameter
        mass = np.pi * own["density"] * diameter * own["width"] * thickness
        outer, inner = np.square(1.0 + share), np.square(1.0 - share)
        factor = 0.25 * ((3.0 + nu) * outer + (1.0 - nu) * inner)
        return cls(own | {"mass": mass}, np.asarray(0.25 * (1.0 + np.square(share))), np.asarray(factor), ratio)

    @property
    def inertia(self) -> Floats:
        """About its shaft, in kg*m^2."""
        return np.asarray(self.form * self.values["mass"] * np.square(self.values["diameter"]))

    @property
    def reduced_inertia(self) -> Floats:
        """Reduced to the main shaft, in kg*m^2."""
        return np.asarray(self.inertia * np.square(self.ratio))

    def results(self, fastest: Floats, drive: Floats, required: Floats) -> dict[str, Floats]:
        """Results by name, each (cases,).

        Parameters
        ----------
        fastest : array, shape (cases,)
            Largest speed of the main shaft in rad/s.
        drive, required : arrays, shape (cases,)
            I' with the flywheel, and the required I', both at the main shaft, in kg*m^2.
        """
        cases = len(fastest)
        own = {name: np.broadcast_to(value[:, 0, 0], (cases,)) for name, value in self.values.items()}
        inertia = np.broadcast_to(self.inertia[:, 0, 0], (cases,))
        factor = np.broadcast_to(self.factor.ravel(), (cases,))
        ratio = np.broadcast_to(self.ratio[:, 0, 0], (cases,))
        speed = 0.5 * own["diameter"] * (fastest * ratio)
        stress = factor * own["density"] * np.square(speed)
        needed = np.maximum(required - (drive - inertia * np.square(ratio)), 0.0) / np.square(ratio)
        margin = np.sqrt(own["allowed_stress"] / stress)
        form = np.broadcast_to(self.form.ravel(), (cases,))
        return {
            "flywheel.inertia": inertia, "flywheel.speed": speed, "flywheel.stress": stress,
            "flywheel.margin": np.where(np.isfinite(margin), margin, np.nan),
            "flywheel.required_mass": needed / (form * np.square(own["diameter"])),
            "flywheel.required_diameter": _ring_diameter(own, needed) if "width" in own
            else np.sqrt(needed / (form * own["mass"])),
        }  # fmt: skip


def _ring_diameter(own: Mapping[str, Floats], inertia: Floats) -> Floats:
    """Mean diameter at which a ring of this section has the ``inertia``: the root of D^3 + t^2 D = 4 J/(pi rho b t)."""
    square = np.square(own["thickness"])
    wanted = 4.0 * inertia / (np.pi * own["density"] * own["width"] * own["thickness"])
    diameter = elementary.power(wanted, 1.0 / 3.0)
    # The cubic is convex and the start above its root, so that Newton's method falls to it.
    for _ in range(_NEWTON):
        diameter = diameter - (diameter * (np.square(diameter) + square) - wanted) / (
            3.0 * np.square(diameter) + square
        )
    return np.asarray(diameter)


def required_inertia(mechanism: Shape, torque: Floats, kind: MeanSpeed, mean: Floats, wanted: Floats) -> Floats:
    """Inertia of the drive, in kg*m^2, with which (omega_max - omega_min)/mean is ``wanted`` at the mean ``mean``.

    For given omega_max and omega_min, the curve 2 (T_0 + A) must touch omega^2 (J + I'') from below with omega_max and
    from above with omega_min. These are two linear equations for T_0 and J. Where the mean is half the sum of both,
    this is the solution; for the other means omega_min is a bracketed root.

    Parameters
    ----------
    mechanism : Shape
        With the mechanism's inertia I'' alone.
    torque : array, shape (cases, panels, NODES)
        Of drive and resistance.
    kind : {"midrange", "angle", "time"}
    mean, wanted : arrays, shape (cases,)

    Returns
    -------
    array, shape (cases,)
        At least 0: a negative solution means that none is required. NaN where the machine with that inertia could not
        run at this mean speed.
    """
    panels, work, inertia = mechanism.panels, mechanism.work, mechanism.inertia

    def solve(slowest: Floats) -> tuple[Floats, Floats]:
        fastest = slowest + wanted * mean
        above = panels.extremes(2.0 * work - (np.square(fastest))[:, None, None] * inertia).highest
        below = panels.extremes(2.0 * work - (np.square(slowest))[:, None, None] * inertia).lowest
        drive = (above - below) / (np.square(fastest) - np.square(slowest))
        return drive, 0.5 * (np.square(fastest) * drive - above)

    slowest = mean * (1.0 - 0.5 * wanted)
    attained = np.ones(len(mean), dtype=np.bool_)
    if kind != "midrange":

        def excess(speed: Floats) -> Floats:
            drive, start = solve(speed)
            shape = replace(mechanism, inertia=inertia + drive[:, None, None])
            return mean_speed(shape, kind, start)[0] - mean

        low, high = np.maximum(mean * (1.0 - wanted), 1e-9 * mean), mean * 1.0
        slowest = bracketed_roots(excess, low, high, -np.ones_like(mean), np.ones_like(mean))
        # The ends of the bracket may not have the expected signs, but then no machine can run so unevenly.
        attained = np.abs(excess(slowest)) <= 1e-6 * mean
    drive = solve(slowest)[0]
    return np.where(_runs(mechanism, torque, kind, mean, drive, attained), np.maximum(drive, 0.0), np.nan)


def _runs(
    mechanism: Shape, torque: Floats, kind: MeanSpeed, mean: Floats, drive: Floats, attained: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Whether the machine with the drive inertia ``drive``, at least 0, runs at the mean speed."""
    whole = replace(mechanism, inertia=mechanism.inertia + np.maximum(drive, 0.0)[:, None, None])
    least = whole.panels.extremes(whole.inertia).lowest
    runs = (least > 1e-12 * whole.panels.largest(whole.inertia)) & np.where(drive > 0.0, attained, True)
    none = np.nonzero(runs & (drive <= 0.0))[0]
    if none.size:
        own = whole.take(none)
        runs[none] = mean[none] > least_mean_speed(own, Stop.of(own), kind, torque[none])
    return np.asarray(runs)


def flywheel_results(
    flywheel: Flywheel | None, columns: Columns, known: Mapping[str, Floats], *, fixed: bool
) -> dict[str, Floats]:
    """The required inertia by the energy alone, and the results of a flywheel given by its dimensions.

    Parameters
    ----------
    flywheel : Flywheel or None
        The one that is given by its dimensions.
    columns : Columns
        The numbers of the cases.
    known : mapping
        Other results by name, each (cases,).
    fixed : bool
        Whether the torques are the same at any speed; otherwise the required inertia is not known.

    Returns
    -------
    dict
        Results by name, each (cases,); NaN for those that the cases do not have.
    """
    names = [info.name for info in result_infos()]
    none = np.full(columns.cases, np.nan)
    out = {name: none for name in names if name.startswith("flywheel.")} | {"required_inertia.energy": none}
    if fixed:
        wanted = columns.row("wanted_irregularity") * np.square(columns.row("mean_speed"))
        finite = np.isfinite(wanted)
        out["required_inertia.energy"] = np.where(
            finite, known["energy.fluctuation"] / np.where(finite, wanted, 1.0), np.nan
        )
    if flywheel is not None:
        out |= flywheel.results(known["omega.max"], known["inertia.drive"], known["required_inertia"])
    return out
