"""The figures of a report are for every run of a schedule, in the page, the report and the mail."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.jobs.reports.curve import small_curve
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.reading.quantities import TYPED
from sprag_study.service.report.document import report_of
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.spec.saved_views import View
from sprag_study.service.views.library import Library
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock


def test_the_next_study_of_a_schedule_has_the_figures_of_the_one_before(service: Service, clock: Clock) -> None:
    service.store.schedules.create(read_fields({"spec": SPEC, "cron": "0 1 * * *"}, NEW_YEAR))
    studies = []
    for day in (1, 2, 3):
        clock.set(f"2026-01-0{day}T01:00")
        Scheduler(service.store).look()
        studies.append(service.store.studies.page().studies[0].id)
        service.fill(studies[-1])
        if day == 1:
            service.store.views.save(View("curves", "Efficiency", "y=efficiency", studies[0], in_report=True))
            service.store.views.save(View("curves", "Torque", "y=torque.mean", studies[0]))
    assert len(set(studies)) == 3
    for study in studies[1:]:
        assert [(one.view.name, one.place) for one in service.store.views.all(study)] == [("Efficiency", 1)]
        (figure,) = report_of(Library(service.store), study).figures
        assert small_curve(service.store, study, TYPED) == figure.draw("png", "Efficiency")
    (first, *_) = service.store.views.all(studies[1])
    service.store.views.remove(first.id)
    Scheduler(service.store).look()  # what was taken out stays out
    assert service.store.views.all(studies[1]) == ()
