"""Saved views in every store: replaced, ordered in the report, with owners and the audit log, gone with their study."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import pytest
import sqlalchemy as sa

from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.faults import FaultError
from sprag_study.service.spec.saved_views import View, ViewChange
from sprag_study.service.storage.errors import NotOwnerError, StudyNotFoundError, TooManyViewsError, ViewNotFoundError
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.saved_views import SAVED_VIEWS
from sprag_study.worker.limits import MAX_REPORT_FIGURES
from tests.contract.filling import create, finish

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store

LIST = View("studies", "failed", "state=failed")


def user(name: str) -> Actor:
    """A designer."""
    return Actor(Door.API, name, "", name, everything=False)


def figure(study: str, name: str, *, in_report: bool = True) -> View:
    """Curves of a study."""
    return View("curves", name, f"y={name}", study, in_report)


def names(store: Store, study: str) -> list[tuple[str, int | None]]:
    """Name and place of the views of a study."""
    return [(one.view.name, one.place) for one in store.views.all(study)]


def test_views_are_saved_replaced_renamed_and_removed(store: Store) -> None:
    study = create(store).id
    made = store.views.save(LIST)
    own = store.views.save(figure(study, "a", in_report=False))
    assert [one.view for one in store.views.general()] == [LIST]
    assert {one.view for one in store.views.all()} == {LIST, own.view}
    again = store.views.save(replace(LIST, query="state=paused"))
    assert (again.id, again.view.query) == (made.id, "state=paused")
    assert store.views.change(made.id, ViewChange(name="paused", query="")).view == View("studies", "paused")
    store.views.save(LIST)
    with pytest.raises(FaultError) as caught:
        store.views.change(made.id, ViewChange(name="failed"))
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [("/name", "repeated")]
    store.views.remove(made.id)
    for act in (store.views.remove, store.views.get, lambda i: store.views.change(i, ViewChange(name="x"))):
        with pytest.raises(ViewNotFoundError):
            act(made.id)
    with pytest.raises(StudyNotFoundError):
        store.views.save(figure("st_nothing", "a"))
    found = [(entry.action, entry.target) for entry in store.audit.page(AuditFilter()).records[:3]]
    assert found[0] == ("view.remove", made.id)
    assert {action for action, _ in found} == {"view.remove", "view.save", "view.change"}


def test_figures_of_a_report_are_in_order(store: Store) -> None:
    study = create(store).id
    revision = store.studies.get(study).revision
    made = {name: store.views.save(figure(study, name)).id for name in "abc"}
    assert names(store, study) == [("a", 1), ("b", 2), ("c", 3)]
    assert store.studies.get(study).revision > revision  # files that were made of the old report are not valid
    store.views.change(made["c"], ViewChange(place=1))
    assert names(store, study) == [("c", 1), ("a", 2), ("b", 3)]
    store.views.change(made["a"], ViewChange(in_report=False))
    assert names(store, study) == [("c", 1), ("b", 2), ("a", None)]
    store.views.save(figure(study, "b", in_report=False))  # new choices; its place is kept
    store.views.remove(made["c"])
    assert names(store, study) == [("b", 1), ("a", None)]
    store.views.change(made["a"], ViewChange(place=MAX_REPORT_FIGURES))
    assert names(store, study) == [("b", 1), ("a", 2)]


def test_reports_and_databases_have_limits(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    study = create(store).id
    for number in range(MAX_REPORT_FIGURES):
        store.views.save(figure(study, f"r{number}"))
    with pytest.raises(FaultError) as caught:
        store.views.save(figure(study, "one more"))
    assert [(fault.where, fault.code) for fault in caught.value.faults] == [("/in_report", "too-many")]
    assert len(store.views.all()) == MAX_REPORT_FIGURES  # nothing of it is left
    monkeypatch.setattr("sprag_study.service.storage.saved_views.MAX_VIEWS", 1)
    store.views.save(LIST)  # figures do not count
    with pytest.raises(TooManyViewsError):
        store.views.save(View("studies", "another", "state=failed"))


def test_views_have_owners(store: Store) -> None:
    with act_as(user("dora")):
        study = create(store).id
        own = store.views.save(figure(study, "a"))
    with act_as(user("emil")):
        for act in (store.views.remove, lambda i: store.views.change(i, ViewChange(name="x"))):
            with pytest.raises(NotOwnerError):
                act(own.id)
        with pytest.raises(NotOwnerError):
            store.views.save(own.view)  # would replace hers
        with pytest.raises(NotOwnerError):
            store.views.save(figure(study, "b"))  # her report
        mine = store.views.save(figure(study, "b", in_report=False))
    assert (mine.owner, own.owner) == ("emil", "dora")


def test_views_go_with_their_study_and_come_back_with_it(store: Store) -> None:
    made = create(store)
    finish(store, made)
    own = store.views.save(figure(made.id, "a"))
    store.views.save(LIST)
    store.studies.delete(made.id)
    assert [one.view for one in store.views.all()] == [LIST]
    with pytest.raises(ViewNotFoundError):
        store.views.get(own.id)
    store.purging.purge()
    with store.session.read() as connection:
        assert connection.execute(sa.select(SAVED_VIEWS.c.name)).scalars().all() == ["failed"]
