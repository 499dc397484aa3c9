"""Faults of machines. A base machine raises these; a case of a grid stores the ending instead."""

import math

from sprag.engine.endings import Ending
from sprag.engine.problems import MachineError


class StructureError(MachineError):
    """The named parts do not form a machine (a missing table, a force without a mechanism, an unknown kind)."""


class TableError(MachineError):
    """A table is not ascending, not finite, too short, or does not close on itself."""

    def __init__(self, message: str, found: float | str, allowed: str) -> None:
        super().__init__(message)
        self.found = found if isinstance(found, str) else f"{found:g}"
        self.allowed = allowed


class RelationError(MachineError):
    """A number contradicts others.

    Attributes
    ----------
    path : str
        Of the number.
    value : float
    allowed : str
        Its range given the others, with the unit.
    """

    def __init__(self, path: str, value: float, message: str, allowed: str) -> None:
        super().__init__(message)
        self.path, self.value, self.allowed = path, value, allowed


class AssemblyError(MachineError):
    """The mechanism cannot be assembled at ``angle`` (rad); ``rule`` states the violated condition, if known.

    ``prefix`` is that of its paths: ``parts.0.`` for the first of several.
    """

    ending = Ending.CANNOT_ASSEMBLE

    def __init__(self, angle: float, rule: str | None = None, prefix: str = "") -> None:
        what = "is refused" if rule else "cannot be assembled"
        why = rule or "its links do not reach each other there"
        which = f" of {prefix.rstrip('.')}" if prefix else ""
        super().__init__(
            f"The mechanism{which} {what} at a shaft angle of {math.degrees(angle):.6g} deg: {why}. "
            "Change the dimensions."
        )
        self.angle, self.prefix = angle, prefix


class NegativeInertiaError(MachineError):
    """The reduced inertia is not positive; ``inertia`` (kg*m^2) is its least value."""

    ending = Ending.NEGATIVE_INERTIA

    def __init__(self, inertia: float) -> None:
        super().__init__(
            f"The reduced inertia falls to {inertia:.6g} kg*m^2 within the cycle; it must be positive at every angle. "
            "Give the drive more inertia, or correct the table or formula of the mechanism."
        )
        self.inertia = inertia
        self.found, self.allowed = f"{inertia:.6g} kg*m^2", "> 0 kg*m^2 at every angle"


class UnbalancedWorkError(MachineError):
    """Drive and resistance do not do opposite work over the cycle, and the requested balance cannot correct it."""

    ending = Ending.UNBALANCED_WORK

    def __init__(self, drive: float, resistance: float, scaled: str = "", friction: float = 0.0) -> None:
        # A work that is the rounding error of the other one is zero.
        most = max(abs(drive), abs(resistance))
        drive, resistance = (0.0 if abs(work) <= 1e-12 * most else work for work in (drive, resistance))
        super().__init__(
            f"The work over a cycle is not zero: the drive does {drive:.6g} J and the resistance {resistance:.6g} J. "
            + self._advice(drive, resistance, scaled, friction)
        )
        self.drive, self.resistance = drive, resistance

    @staticmethod
    def _advice(drive: float, resistance: float, scaled: str, friction: float) -> str:
        if not scaled:
            return 'Steady motion needs opposite works: choose balance "scale" or "constant", or correct the torques.'
        own, other = (drive, resistance) if scaled == "driving torque" else (resistance + friction, drive)
        if abs(own) <= 1e-9 * abs(other):
            return f"No factor on the {scaled} balances that, since it does no work over a cycle of its own."
        if abs(other) <= 1e-9 * abs(own):
            rest = "operation" if scaled == "driving torque" else "driving torque"
            return f"No positive factor on the {scaled} balances that, since the {rest} does no work over a cycle."
        if scaled == "operation" and own < 0.0 < drive:
            return (
                f"No positive factor on the operation balances that: the friction of the shaft takes {friction:.6g} J."
            )
        if drive < 0.0 and resistance < 0.0:
            return f"No positive factor on the {scaled} balances that: the driving torque brakes, too."
        return f"No positive factor on the {scaled} balances that: the operation drives instead of resisting."


class InsufficientInertiaError(MachineError):
    """The shaft would stop at the required mean speed; ``least_mean_speed`` (rad/s) is the least feasible one.

    A mean over time can exceed this and still require a shaft that nearly stops. NaN where a load follows the speed.
    """

    ending = Ending.INERTIA_INSUFFICIENT

    def __init__(self, asked: float, least_mean_speed: float) -> None:
        stops = f"The inertia is insufficient for a mean speed of {_in_rpm(asked)}: the shaft would "
        if math.isnan(least_mean_speed):
            more = "stop within the cycle. Choose a higher mean speed, or give the drive more inertia."
        elif asked > least_mean_speed:
            more = "nearly stop within the cycle. Choose a higher mean speed, or give the drive more inertia."
        else:
            more = (
                f"stop within the cycle. The least feasible mean speed is {_in_rpm(least_mean_speed)}; "
                "or give the drive more inertia."
            )
        super().__init__(stops + more)
        self.asked, self.least_mean_speed = asked, least_mean_speed
        self.allowed = "a higher speed" if math.isnan(least_mean_speed) else f"> {_in_rpm(least_mean_speed)}"


def _in_rpm(speed: float) -> str:
    """A speed in rad/s with its revolutions a minute."""
    return f"{speed:.6g} rad/s ({speed * 30.0 / math.pi:.6g} rpm)"


class MotorStalledError(MachineError):
    """The motor has no steady cycle with this load, which stalls it."""

    ending = Ending.MOTOR_STALLED

    def __init__(self) -> None:
        super().__init__(Ending.MOTOR_STALLED.sentence)


class MotorOverrunError(MachineError):
    """The load drives the shaft harder than the motor can brake it."""

    ending = Ending.MOTOR_OVERRUN

    def __init__(self) -> None:
        super().__init__(Ending.MOTOR_OVERRUN.sentence)


class NearSingularError(MachineError):
    """The mechanism passes so close to a singular position that its motion is not resolved."""

    ending = Ending.NEAR_SINGULAR

    def __init__(self) -> None:
        super().__init__(Ending.NEAR_SINGULAR.sentence)


class QuadratureError(MachineError):
    """Torque or inertia is too rough to be integrated to 1e-10."""

    ending = Ending.QUADRATURE_NOT_REACHED

    def __init__(self) -> None:
        super().__init__(Ending.QUADRATURE_NOT_REACHED.sentence)
