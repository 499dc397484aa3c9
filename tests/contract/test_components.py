"""The catalogue of components: kept, replaced, removed, with owners and the audit log, in every store."""

from __future__ import annotations

import pytest

from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.spec.components import Component
from sprag_study.service.storage.errors import ComponentNotFoundError, NotOwnerError, TooManyComponentsError
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.store import Store

SPRING = Component("spring", "F-120", "store 3", {"spring_rate": "9 Н/мм"})
CLUTCH = Component("clutch", "FW 20", "", {"coefficients": "0; 200"})


def test_components_are_kept_replaced_and_removed(store: Store) -> None:
    made = store.components.put([SPRING, CLUTCH])
    assert [record.component for record in made] == [SPRING, CLUTCH]
    assert [record.component.kind for record in store.components.all()] == ["clutch", "spring"]
    changed = Component("spring", "F-120", "", {"spring_rate": "10 N/mm"})
    again = store.components.put([changed])
    assert (again[0].id, again[0].component) == (made[0].id, changed)
    assert [record.component for record in store.components.all("spring")] == [changed]
    store.components.remove(made[0].id)
    assert store.components.all("spring") == ()
    with pytest.raises(ComponentNotFoundError):
        store.components.remove(made[0].id)
    found = [(entry.action, entry.target) for entry in store.audit.page(AuditFilter()).records[:4]]
    assert found == [
        ("component.remove", made[0].id),
        ("component.change", made[0].id),
        ("component.add", made[1].id),
        ("component.add", made[0].id),
    ]


def test_a_component_of_another_user_is_not_changed(store: Store) -> None:
    dora = Actor(Door.API, "dora", "", "dora", everything=False)
    emil = Actor(Door.API, "emil", "", "emil", everything=False)
    with act_as(dora):
        made = store.components.put([SPRING])[0]
        assert made.owner == "dora"
    with act_as(emil):
        with pytest.raises(NotOwnerError):
            store.components.put([CLUTCH, SPRING])
        with pytest.raises(NotOwnerError):
            store.components.remove(made.id)
    assert [record.component for record in store.components.all()] == [SPRING]  # all or none


def test_the_catalogue_has_a_limit(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sprag_study.service.storage.components.MAX_COMPONENTS", 20)
    many = [Component("spring", f"F-{number}", "", {"spring_rate": "1 N/mm"}) for number in range(20)]
    store.components.put(many)
    with pytest.raises(TooManyComponentsError):
        store.components.put([CLUTCH])
    assert len(store.components.all()) == 20
