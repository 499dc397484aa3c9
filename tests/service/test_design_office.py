"""Three questions of a design office, each one spec of the guide, against all designs that there are."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.text import load_spec
from sprag_study.worker import models
from sprag_study.worker.rounds import Rounds
from tests.service.rounds import run_round
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.service.conftest import Service

GUIDE = (Path(__file__).parents[2] / "docs/guide-goals.md").read_text("utf-8")


def asked(title: str) -> dict[str, Any]:
    """The fields of a spec below a heading of the guide."""
    block = re.search(rf"### {title}\n.*?```json\n(.*?)```", GUIDE, re.DOTALL)
    assert block is not None
    fields: dict[str, Any] = json.loads("{" + block[1] + "}")
    return fields


def press() -> dict[str, Any]:
    spec: dict[str, Any] = load_spec(preset_text("least_flywheel")[1], "toml")  # type: ignore[assignment]
    return {name: json.loads(json.dumps(entry)) for name, entry in spec.items() if name != "goal"}


def drive() -> dict[str, Any]:
    return {name: entry for name, entry in SPEC.items() if name in {"sprag", "model", "base"}}


def found(service: Service, spec: dict[str, Any]) -> dict[str, Any]:
    """The best design of a search."""
    study_id = service.submit(spec)
    store = service.store
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)
    for _ in range(99):
        run_round(store, number, epoch, lambda study, cases: models.run_chunk(study, cases.start, len(cases)))
        if planner.advance(epoch, number, store.studies.study(study_id)) is None:
            break
    best: dict[str, Any] = service.get(f"/studies/{study_id}/front", limit=1)["designs"][0]
    assert best["feasible"]
    return best


def every(spec: dict[str, Any], results: list[str]) -> tuple[dict[str, Any], NDArray[np.float64]]:
    """All designs of the catalogues of a search at all its points: columns (designs, points, drives), results."""
    goal = spec["goal"]
    axes = [{"path": one["path"], "values": one["values"]} for one in goal["vary"]]
    (path,) = {name for point in goal["at"] for name in point if name != "name"}
    axes.append({"path": path, "values": [point[path] for point in goal["at"]]})
    plain = {name: entry for name, entry in spec.items() if name not in {"goal", "quantities"}}
    study = parse_spec({**plain, "axes": axes}).study
    rows = models.run_chunk(study, 0, study.cases)
    names = [info.name for info in models.study_results(study)]
    shape = (-1, len(goal["at"]), 1 + study.drives)
    columns = {name: column.reshape(shape) for name, column in study.columns(range(study.cases)).items()}
    usable = models.usable(study.model, rows.endings, rows.flags)
    values = (np.where(usable, rows.values[:, names.index(name)], np.nan) for name in results)
    return columns, np.array([column.reshape(shape) for column in values])


def test_the_cheapest_flywheel_for_two_speeds(service: Service) -> None:
    spec = {**press(), **asked("The cheapest flywheel for two speeds")}
    columns, (irregularity,) = every(spec, ["irregularity"])
    inertia, rod = (columns[path][:, 0, 0] for path in ("drive.inertia", "mechanism.slider_crank.rod"))
    price = 180.0 + 9.5 * inertia + 400.0 * rod
    meets = (irregularity[:, 0, 0] <= 0.1) & (irregularity[:, 1, 0] <= 1 / 20)
    assert 0 < np.count_nonzero(meets) < len(meets)
    best = found(service, spec)
    assert best["goals"]["price"] == pytest.approx(price[meets].min(), rel=1e-12)
    alone = price[(irregularity[:, :, 0] <= 1 / 20).all(axis=1)].min()
    assert price[meets].min() < alone  # the limit of the fast point at both would cost more


def test_the_cheapest_flywheel_in_most_machines(service: Service) -> None:
    spec = {**press(), **asked("The cheapest flywheel that most machines keep")}
    columns, (irregularity,) = every(spec, ["irregularity"])
    price = 180.0 + 9.5 * columns["drive.inertia"][:, 0, 0]
    share = (irregularity[:, :, 1:] <= 0.07).all(axis=1).mean(axis=1)
    assert price[irregularity[:, 0, 0] <= 0.07].min() < price[share >= 0.9].min()
    best = found(service, spec)
    assert best["goals"]["price"] == pytest.approx(price[share >= 0.9].min(), rel=1e-12)


def test_the_largest_power_per_mass_anywhere_along_the_load(service: Service) -> None:
    spec = {**drive(), **asked("The largest power anywhere along the load")}
    columns, (power, torque) = every(spec, ["power.useful.mean", "torque.max"])
    mass = columns["pendulums.0.mass"][:, 0, 0]
    specific = power[:, :, 0].max(axis=1) / mass
    meets = (torque[:, :, 0] <= 3.0).all(axis=1)
    assert 0 < np.count_nonzero(meets) < len(meets)
    best = found(service, spec)
    assert best["goals"]["specific_power (best)"] == pytest.approx(specific[meets].max(), rel=1e-9)
    assert len(list(itertools.product(*(one["values"] for one in spec["goal"]["vary"])))) == len(mass)
