"""Machine shafts solved per second on one core, and the cost of definitions of the mean and kinds of axes.

All in one run of this program, in turn; the ratios are to the first line. Then the same question as a study, through
spec, dispatcher, one pool process and SQLite, against the engine alone.

    python -m benchmarks.machine_shaft [--cases 2000] [--repeats 3] [--study 20000]
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Mapping
from dataclasses import replace
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from typing import Any

import numpy as np

from sprag_study.engine.machine_shaft.estimate import estimate_seconds
from sprag_study.engine.machine_shaft.simulate import simulate
from sprag_study.engine.machine_shaft.spec import Drive, MachineSpec, MechanismChoice, OperationChoice
from sprag_study.engine.machine_shaft.tables import Table
from sprag_study.service.jobs.local import run_here
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models

PRESS = MachineSpec(
    mechanism=MechanismChoice("slider_crank"), operation=OperationChoice("force", "steps", steps=1), balance="constant"
)
NUMBERS: dict[str, Any] = {
    "mean_speed": 4.0 * math.pi,
    "drive.inertia": 15.0,
    "mechanism.slider_crank.crank": 0.1,
    "mechanism.slider_crank.rod": 0.4,
    "mechanism.slider_crank.rod_centre": 0.16,
    "mechanism.slider_crank.rod_mass": 6.0,
    "mechanism.slider_crank.rod_inertia": 0.12,
    "mechanism.slider_crank.ram_mass": 20.0,
    "operation.steps.0.from": math.radians(120.0),
    "operation.steps.0.to": math.radians(180.0),
    "operation.steps.0.value": 20e3,
}

#: The same press as a spec.
BASE: dict[str, Any] = {
    "mean_speed": "120 rpm",
    "drive": {"inertia": "15 kg*m^2"},
    "mechanism": {"slider_crank": {
        "crank": "100 mm", "rod": "400 mm", "rod_centre": "160 mm", "rod_mass": "6 kg", "rod_inertia": "0.12 kg*m^2",
        "ram_mass": "20 kg",
    }},
    "operation": {"quantity": "force", "steps": [{"from": "120 deg", "to": "180 deg", "value": "20 kN"}]},
}  # fmt: skip


def studies(cases: int) -> dict[str, tuple[MachineSpec, Mapping[str, Any]]]:
    """The presets' three questions, and features that make a case more expensive."""
    inertia = NUMBERS | {"drive.inertia": np.linspace(5.0, 50.0, cases)}
    ram = NUMBERS | {"mechanism.slider_crank.ram_mass": np.linspace(1.0, 60.0, cases)}
    ram["mechanism.slider_crank.crank"] = np.linspace(0.08, 0.12, cases)
    onset = NUMBERS | {"operation.steps.0.from": np.radians(np.linspace(100.0, 140.0, cases))}
    motor = {path: value for path, value in inertia.items() if path != "mean_speed"}
    motor |= {"drive.motor.synchronous_speed": 13.0, "drive.motor.breakdown_torque": 500.0}
    motor |= {"drive.motor.breakdown_slip": 0.15}
    rows = tuple((math.radians(a), 130.0 + 40.0 * math.sin(math.radians(a))) for a in range(0, 360, 10))
    tabled = replace(PRESS, balance="scale", drive=Drive("table", table=Table(rows)))
    load = {path: value for path, value in inertia.items() if not path.startswith("operation")}
    own = load | {"constants.a": np.linspace(2.0, 3.0, cases)}

    def formula(text: str, *constants: str) -> MachineSpec:
        return replace(PRESS, operation=OperationChoice("torque", "formula", formula=text), constants=constants)

    return {
        "drive inertia, midrange": (PRESS, inertia),
        "drive inertia, mean over angle": (replace(PRESS, mean_speed_is="angle"), inertia),
        "drive inertia, mean over time": (replace(PRESS, mean_speed_is="time"), inertia),
        "masses and geometry": (PRESS, ram),
        "onset of the force": (PRESS, onset),
        "with the flywheel for an irregularity": (PRESS, inertia | {"wanted_irregularity": 0.05}),
        "driving torque from a table of 36 rows": (tabled, inertia),
        "formula that all cases share": (formula("100 + 50*sin(phi)"), load),
        "formula with a constant": (formula("100 + a*sin(phi)", "a"), own),
        "formula with a jump": (formula("if(phi > a, 1000, 0)", "a"), own),
        "formula with a wide peak": (formula("10 + 100*exp(-(phi - a)^2)", "a"), own),
        "formula with a peak of half a degree": (formula("10 + 1e4*exp(-((phi - a)/0.01)^2)", "a"), own),
        "motor, limit cycle": (replace(PRESS, balance="motor", drive=Drive(motor="kloss")), motor),
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=2_000)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--study", type=int, default=20_000, help="cases of the study; 0: none")
    arguments = parser.parse_args()
    first = 0.0
    print(f"{'':40}{'cases/s':>10}{'ratio':>8}{'estimate':>10}")
    for name, (spec, numbers) in studies(arguments.cases).items():
        simulate(spec, numbers, cases=arguments.cases)
        best = math.inf
        for _ in range(arguments.repeats):
            start = time.process_time()
            simulate(spec, numbers, cases=arguments.cases)
            best = min(best, time.process_time() - start)
        rate = arguments.cases / best
        first = first or rate
        print(f"{name:40}{rate:10.0f}{rate / first:8.2f}{1.0 / estimate_seconds(spec):10.0f}")
    if arguments.study:
        through_the_service(arguments.study)


def through_the_service(cases: int) -> None:
    """Measure a study of drive inertias from its submission to its last row, on one process."""
    spec = {
        "sprag": 1, "model": "machine-shaft", "base": BASE,
        "axes": [{"path": "drive.inertia", "linspace": ["5 kg*m^2", "50 kg*m^2", cases]}],
    }  # fmt: skip
    study = parse_spec(spec).study
    models.run_chunk(study, 0, 100)
    start = processor_seconds()
    models.run_chunk(study, 0, cases)
    alone = processor_seconds() - start
    start, wall = processor_seconds(), time.perf_counter()
    with run_here(spec, study, processes=1) as done:
        wall = time.perf_counter() - wall
        assert done.record.done == cases
    whole = processor_seconds() - start
    print(f"\n{cases} cases as a study on one process, processor time: engine alone {alone:.2f} s "
          f"({cases / alone:.0f} cases/s), all of the service {whole:.2f} s ({cases / whole:.0f} cases/s, "
          f"ratio {whole / alone:.2f}), of which the pool's start is about 1 s; {wall:.2f} s by the clock")  # fmt: skip


def processor_seconds() -> float:
    """Processor time of this process and of its ended children, in s."""
    return sum(use.ru_utime + use.ru_stime for use in map(getrusage, (RUSAGE_SELF, RUSAGE_CHILDREN)))


if __name__ == "__main__":
    main()
