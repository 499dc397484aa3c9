"""Checks of numbers that are individually in range but contradict each other; done before a base machine is solved."""

from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.drive_train import Train
from sprag_study.engine.machine_shaft.operations import reachable_pressure
from sprag_study.engine.machine_shaft.problems import RelationError, alone, amount
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.sentences import Sentence


def check_relations(spec: MachineSpec, row: Columns) -> None:
    """Refuse contradictory numbers of the first case.

    Raises
    ------
    RelationError
        A belt with a mass but without a radius; a coupling with nothing that turns on one side of it; a rim that is
        thicker than its mean diameter; discharge below suction, or above what the clearance lets the compressor reach;
        a step over the stroke that ends before it begins.
    """
    _check_stages(spec, row)
    _check_couplings(spec, row)
    if spec.drive.flywheel == "ring":
        _check_ring(row)
    for prefix, part in spec.every_part():
        if part.operation.quantity == "gas":
            _check_gas(row, f"{prefix}operation.gas.")
        elif part.operation.form == "steps" and part.operation.over == "stroke":
            _check_steps(row, f"{prefix}operation.steps.", part.operation.steps)


def _check_stages(spec: MachineSpec, row: Columns) -> None:
    for index, kind in enumerate(spec.drive.stages):
        path = f"drive.stages.{index}.radius"
        if kind in {"belt", "chain"} and row.row(f"drive.stages.{index}.mass")[0] > 0.0 == row.row(path)[0]:
            message = (
                Sentence("is needed for the speed of the belt, which has a mass")
                if kind == "belt"
                else Sentence("is needed for the speed of the chain, which has a mass")
            )
            raise RelationError(path, 0.0, message, alone(">", amount(0.0, "m")))


def _check_couplings(spec: MachineSpec, row: Columns) -> None:
    """Refuse a coupling before which nothing turns, as far as the last coupling before it, or nothing after the last.

    The mechanism turns with the main shaft, so that behind the last coupling its inertia is enough.
    """
    chain = Train.of(spec.drive, row.values).chain
    if chain is None:
        return
    stages = [index for index, kind in enumerate(spec.drive.stages) if kind == "coupling"]
    bare = all(part.mechanism.kind == "none" for _, part in spec.every_part())
    for body, inertia in enumerate(chain.inertias):
        last = body == len(stages)
        if inertia[0, 0, 0] > 0.0 or (last and not bare):
            continue
        if body:
            place = f"{stages[body - 1]}.output_inertia"
            why = Sentence(
                "is needed: nothing else turns between this coupling and the next one, or the end of the train"
            )
        else:
            place = f"{stages[0]}.inertia"
            why = Sentence("is needed: nothing else turns before this coupling; give the rotor of the motor here")
        raise RelationError(f"drive.stages.{place}", 0.0, why, alone(">", amount(0.0, "kg*m^2")))


def _check_ring(row: Columns) -> None:
    path = "drive.flywheel.thickness"
    thickness, diameter = (float(row.row(name)[0]) for name in (path, "drive.flywheel.diameter"))
    if thickness > diameter:
        message = Sentence("is more than the mean diameter of the rim, so that there is no inner edge")
        raise RelationError(path, thickness, message, alone("<=", amount(diameter, "m")))


def _check_steps(row: Columns, prefix: str, steps: int) -> None:
    for k in range(steps):
        first, last = (float(row.row(f"{prefix}{k}.{end}")[0]) for end in ("from", "to"))
        if last < first:
            raise RelationError(
                f"{prefix}{k}.to", last,
                Sentence(
                    "a step over the stroke cannot end before it begins: this one begins at {begin} and would never "
                    "act; `during` selects the stroke",
                    begin=amount(first),
                ),
                Sentence(">= {low} and <= {high}", low=amount(first), high=1),
            )  # fmt: skip


def _check_gas(row: Columns, prefix: str) -> None:
    low, high, clearance, exponent = (
        row.row(f"{prefix}{name}") for name in ("suction_pressure", "discharge_pressure", "clearance", "exponent")
    )
    most, least, wanted = float(reachable_pressure(low, clearance, exponent)[0]), float(low[0]), float(high[0])
    if least <= wanted <= most:
        return
    suction, highest = amount(least, "Pa"), amount(most, "Pa")
    message = (
        Sentence("is below the suction pressure: nothing would be compressed")
        if wanted < least
        else Sentence(
            "cannot be reached: at the end of the stroke a clearance of {clearance} times the displaced volume is "
            "left, and the gas reaches {most} at most",
            clearance=amount(clearance[0]),
            most=highest,
        )
    )
    bounded = most < float("inf")
    allowed = Sentence(">= {low} and <= {high}", low=suction, high=highest) if bounded else alone(">=", suction)
    raise RelationError(f"{prefix}discharge_pressure", wanted, message, allowed)
