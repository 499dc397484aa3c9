"""Faults of machines. A base machine raises these; a case of a grid stores the ending instead."""

import math

from sprag_study.engine.endings import Ending
from sprag_study.engine.problems import MachineError
from sprag_study.sentences import Amount, Part, Sentence, joined


def amount(value: float, unit: str = "1") -> Amount:
    """A number of a sentence, with six digits."""
    return Amount(float(value), unit, 6)


def alone(*parts: Part) -> Sentence:
    """Parts without words, such as ``> 0 m``."""
    return joined(" ", parts)


class StructureError(MachineError):
    """The named parts do not form a machine (a missing table, a force without a mechanism, an unknown kind)."""


class TableError(MachineError):
    """A table is not ascending, not finite, too short, or does not close on itself."""

    def __init__(self, message: Sentence, found: Amount | Sentence, allowed: Sentence) -> None:
        super().__init__(message)
        self.found = found if isinstance(found, Sentence) else alone(found)
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

    def __init__(self, path: str, value: float, message: Sentence, allowed: Sentence) -> None:
        super().__init__(message)
        self.path, self.value, self.allowed = path, value, allowed


class AssemblyError(MachineError):
    """The mechanism cannot be assembled at ``angle`` (rad); ``rule`` states the violated condition, if known.

    ``prefix`` is that of its paths: ``parts.0.`` for the first of several.
    """

    ending = Ending.CANNOT_ASSEMBLE

    def __init__(self, angle: float, rule: Sentence | None = None, prefix: str = "") -> None:
        which = Sentence(" of {part}", part=prefix.rstrip(".")) if prefix else ""
        parts: dict[str, Part] = {"which": which, "angle": amount(math.degrees(angle), "deg")}
        super().__init__(
            Sentence(
                "The mechanism{which} cannot be assembled at a shaft angle of {angle}: its links do not reach each "
                "other there. Change the dimensions.",
                **parts,
            )
            if rule is None
            else Sentence(
                "The mechanism{which} is refused at a shaft angle of {angle}: {rule}. Change the dimensions.",
                rule=rule,
                **parts,
            )
        )
        self.angle, self.prefix = angle, prefix


class NegativeInertiaError(MachineError):
    """The reduced inertia is not positive; ``inertia`` (kg*m^2) is its least value."""

    ending = Ending.NEGATIVE_INERTIA

    def __init__(self, inertia: float) -> None:
        least = amount(inertia, "kg*m^2")
        super().__init__(
            Sentence(
                "The reduced inertia falls to {least} within the cycle; it must be positive at every angle. "
                "Give the drive more inertia, or correct the table or formula of the mechanism.",
                least=least,
            )
        )
        self.inertia = inertia
        self.found, self.allowed = alone(least), Sentence("> {low} at every angle", low=amount(0.0, "kg*m^2"))


class UnbalancedWorkError(MachineError):
    """Drive and resistance do not do opposite work over the cycle, and the requested balance cannot correct it.

    ``scaled`` is what the balance scales: "drive", "operation", or "" for none.
    """

    ending = Ending.UNBALANCED_WORK

    def __init__(self, drive: float, resistance: float, scaled: str = "", friction: float = 0.0) -> None:
        # A work that is the rounding error of the other one is zero.
        most = max(abs(drive), abs(resistance))
        drive, resistance = (0.0 if abs(work) <= 1e-12 * most else work for work in (drive, resistance))
        works = Sentence(
            "The work over a cycle is not zero: the drive does {drive} and the resistance {resistance}.",
            drive=amount(drive, "J"),
            resistance=amount(resistance, "J"),
        )
        super().__init__(joined(" ", (works, self._advice(drive, resistance, scaled, friction))))
        self.drive, self.resistance = drive, resistance

    @staticmethod
    def _advice(drive: float, resistance: float, scaled: str, friction: float) -> Sentence:
        if not scaled:
            return Sentence(
                'Steady motion needs opposite works: choose balance "scale" or "constant", or correct the torques.'
            )
        by_drive = scaled == "drive"
        own, other = (drive, resistance) if by_drive else (resistance + friction, drive)
        factor = Sentence("factor on the driving torque") if by_drive else Sentence("factor on the operation")
        if abs(own) <= 1e-9 * abs(other):
            return Sentence("No {factor} balances that, since it does no work over a cycle of its own.", factor=factor)
        if abs(other) <= 1e-9 * abs(own):
            why = (
                Sentence("since the operation does no work over a cycle")
                if by_drive
                else Sentence("since the driving torque does no work over a cycle")
            )
            return Sentence("No positive {factor} balances that, {why}.", factor=factor, why=why)
        if not by_drive and own < 0.0 < drive:
            why = Sentence("the friction of the shaft takes {friction}", friction=amount(friction, "J"))
        elif drive < 0.0 and resistance < 0.0:
            why = Sentence("the driving torque brakes, too")
        else:
            why = Sentence("the operation drives instead of resisting")
        return Sentence("No positive {factor} balances that: {why}.", factor=factor, why=why)


class InsufficientInertiaError(MachineError):
    """The shaft would stop at the required mean speed; ``least_mean_speed`` (rad/s) is the least feasible one.

    A mean over time can exceed this and still require a shaft that nearly stops. NaN where a load follows the speed.
    """

    ending = Ending.INERTIA_INSUFFICIENT

    def __init__(self, asked: float, least_mean_speed: float) -> None:
        speed, least = _in_rpm(asked), _in_rpm(least_mean_speed)
        if math.isnan(least_mean_speed):
            message = Sentence(
                "The inertia is insufficient for a mean speed of {speed}: the shaft would stop within the cycle. "
                "Choose a higher mean speed, or give the drive more inertia.",
                speed=speed,
            )
        elif asked > least_mean_speed:
            message = Sentence(
                "The inertia is insufficient for a mean speed of {speed}: the shaft would nearly stop within the "
                "cycle. Choose a higher mean speed, or give the drive more inertia.",
                speed=speed,
            )
        else:
            message = Sentence(
                "The inertia is insufficient for a mean speed of {speed}: the shaft would stop within the cycle. The "
                "least feasible mean speed is {least}; or give the drive more inertia.",
                speed=speed,
                least=least,
            )
        super().__init__(message)
        self.asked, self.least_mean_speed = asked, least_mean_speed
        self.allowed = Sentence("a higher speed") if math.isnan(least_mean_speed) else alone(">", least)


def _in_rpm(speed: float) -> Sentence:
    """A speed in rad/s with its revolutions a minute."""
    return Sentence("{speed} ({turns})", speed=amount(speed, "rad/s"), turns=amount(speed * 30.0 / math.pi, "rpm"))


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
