"""Users, quotas and the audit log on every database: what is written, and that it is written with its change."""

from __future__ import annotations

import random
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from typing import Any

import pytest
import sqlalchemy as sa

from sprag_study.service.actor import Actor, Door, Role, act_as, acting, of_machine
from sprag_study.service.faults import FaultError
from sprag_study.service.spec.components import Component
from sprag_study.service.spec.labels import StudyChange
from sprag_study.service.spec.saved_views import View, ViewChange
from sprag_study.service.storage.errors import (
    IdempotencyConflictError,
    NotOwnerError,
    UserExistsError,
    UserNotFoundError,
)
from sprag_study.service.storage.people.accounts import Account
from sprag_study.service.storage.people.audit import AuditFilter
from sprag_study.service.storage.people.people import STUDY_BYTES, TEXTS, Quota
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies import studies as studies_of_store
from sprag_study.service.storage.tables import STUDIES
from sprag_study.worker.limits import MAX_NOTES_LENGTH
from sprag_study.worker.states import StudyState
from tests.contract.filling import create, finish
from tests.worker import fakes


def user(name: str, role: Role = Role.DESIGNER) -> Actor:
    """A user who asks from somewhere."""
    return Actor(Door.API, name, "192.0.2.1", name, role is Role.ADMINISTRATOR)


def actions(store: Store) -> list[tuple[str, str, str]]:
    """Actor, action and target of every row, earliest first."""
    return [(row.actor, row.action, row.target) for row in store.audit.rows(AuditFilter())]


def test_users_are_added_changed_removed_and_restored(store: Store) -> None:
    made = store.people.add_user("dora", Role.DESIGNER, Quota(cases=7))
    assert (made.name, made.role, made.removed_at, made.quota) == ("dora", "designer", None, Quota(cases=7))
    with pytest.raises(UserExistsError):
        store.people.add_user("dora", Role.VIEWER)
    assert store.people.change_user("dora", quota=Quota(bytes=3)).quota == Quota(7, 3)
    assert store.people.change_user("dora", Role.VIEWER).role is Role.VIEWER
    assert store.people.change_user("dora", removed=True).removed_at == store.clock.now()
    with pytest.raises(UserExistsError):
        store.people.add_user("dora", Role.VIEWER)
    with pytest.raises(UserNotFoundError):
        store.people.create_token("hers", TokenScope.WRITE, owner="dora")
    assert store.people.change_user("dora", removed=False).removed_at is None
    with pytest.raises(UserNotFoundError):
        store.people.change_user("emil", removed=True)
    assert [row[1] for row in actions(store)] == [
        "user.add", "user.change", "user.change", "user.remove", "user.restore",
    ]  # fmt: skip


def test_everybody_has_idempotency_keys_of_their_own(store: Store) -> None:
    """The key of somebody else with the same body is a key that nobody has sent."""
    for name in ("dora", "emil"):
        store.people.add_user(name, Role.DESIGNER)
    tokens = [Actor(Door.API, name, "192.0.2.1", token=name) for name in ("tk_1", "tk_2")]
    senders = [of_machine(Door.PROGRAM), user("dora"), user("emil"), *tokens]
    made = []
    for sender in senders[1:]:  # nobody last: a token without a user has the keys of nobody
        with act_as(sender):
            made.append(create(store, idempotency_key="k", body_hash="a").id)
    with act_as(senders[0]):
        made.insert(0, create(store, idempotency_key="k", body_hash="a").id)
    assert len(set(made)) == len(senders)
    for sender, study_id in zip(senders, made, strict=True):
        with act_as(sender):
            known = store.studies.of_key("k", "a")
            assert known is not None
            assert known.id == study_id
            assert create(store, idempotency_key="k", body_hash="a").id == study_id
            with pytest.raises(IdempotencyConflictError):
                store.studies.of_key("k", "b")
    with act_as(replace(user("dora"), token="tk_3")):  # whatever token
        assert create(store, idempotency_key="k", body_hash="a").id == made[1]
    with act_as(senders[0]):
        kept = create(store, idempotency_key="before", body_hash="a").id
    with act_as(tokens[0]):
        assert create(store, idempotency_key="before", body_hash="a").id == kept
    with act_as(user("dora")):
        assert store.studies.of_key("before", "a") is None


def test_what_users_make_is_theirs_and_is_handed_over(store: Store) -> None:
    for name in ("dora", "emil"):
        store.people.add_user(name, Role.DESIGNER)
    with act_as(user("dora")):
        made = create(store)
        store.components.put([Component("spring", "F-120", "", {"spring_rate": "9 N/mm"})])
        store.views.save(View("studies", "mine", "owner=dora"))
    finish(store, made)
    assert store.studies.get(made.id).owner == "dora"
    for change in (store.studies.retry, store.studies.delete, lambda i: store.studies.prioritize(i, 3)):
        with act_as(user("emil")), pytest.raises(NotOwnerError):
            change(made.id)
    store.studies.restorable = timedelta(days=1)
    with act_as(user("dora")):
        deleted = create(store)
        finish(store, deleted)
        store.studies.delete(deleted.id)
    assert store.people.hand_over("dora", "emil") == (2, 0)
    with act_as(user("emil")):
        store.studies.restore(deleted.id)
    assert [one.owner for one in (*store.components.all(), *store.views.all())] == ["emil", "emil"]
    with pytest.raises(UserNotFoundError):
        store.people.hand_over("emil", "nobody")
    with act_as(user("dora")), pytest.raises(NotOwnerError):
        store.studies.delete(made.id)
    with act_as(user("emil")):
        store.studies.delete(made.id)
    assert actions(store)[-3:] == [
        (acting().name, "user.hand-over", "dora"), ("emil", "study.restore", deleted.id),
        ("emil", "study.delete", made.id),
    ]  # fmt: skip


def test_a_change_that_fails_leaves_no_row_and_a_row_that_fails_no_change(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = create(store)
    finish(store, made)
    before = actions(store)

    def fail(*_: Any, **__: Any) -> None:
        raise RuntimeError("the process dies here")

    with monkeypatch.context() as patch:
        patch.setattr(studies_of_store, "note", fail)
        with pytest.raises(RuntimeError):
            store.studies.delete(made.id)
    assert store.studies.get(made.id).state is StudyState.FINISHED
    connections = store.session.write

    @contextmanager
    def dying() -> Iterator[sa.Connection]:
        with connections() as connection:
            yield connection
            raise RuntimeError("killed before the commit")

    with monkeypatch.context() as patch:
        patch.setattr(store.session, "write", dying)
        with pytest.raises(RuntimeError):
            store.studies.delete(made.id)
    assert store.studies.get(made.id).state is StudyState.FINISHED
    assert actions(store) == before


def test_quotas_count_what_waits_and_what_is_stored(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER, Quota(cases=50))
    store.people.default_quota = Quota(cases=10)
    with act_as(user("dora")):
        first = create(store, 30)
        with pytest.raises(FaultError) as refused:
            create(store, 30)
        assert refused.value.code == "quota-exceeded"
        assert "30 of 50" in refused.value.detail
        create(store, 20)
        finish(store, first)
        create(store, 30)
    with store.session.write() as connection:
        connection.execute(sa.update(STUDIES).where(STUDIES.c.id == first.id).values(estimated_bytes=900))
        studies = connection.execute(sa.select(STUDIES).where(STUDIES.c.owner == "dora")).mappings().all()
        texts = sum(STUDY_BYTES + sum(len(study[name].encode()) for name in TEXTS) for study in studies)
    assert (store.people.usage("dora").cases, store.people.usage("dora").bytes) == (50, 900 + texts)
    store.people.default_quota = Quota(cases=10, bytes=1000 + STUDY_BYTES + texts)
    store.people.change_user("dora", quota=Quota(cases=0))
    row = {"name": "", "spec": "{}"}
    with (
        act_as(user("dora")),
        pytest.raises(FaultError, match=r"about 20,480 MiB more, and dora has used 0\.0 of 0\.0 MiB"),
    ):
        store.studies.insert({**_row(store), **row, "estimated_bytes": 20 * 2**30})
    with act_as(user("dora")), pytest.raises(FaultError, match="MiB"):
        store.studies.insert({**_row(store), **row, "estimated_bytes": 101})
    store.studies.restorable = timedelta(days=1)
    store.studies.delete(first.id)
    with act_as(user("dora")), pytest.raises(FaultError, match="MiB"):  # it lies on the disk as before
        store.studies.insert({**_row(store), **row, "estimated_bytes": 101})
    store.studies.delete(first.id, at_once=True)
    with act_as(user("dora")), pytest.raises(FaultError, match="MiB"):
        store.studies.insert({**_row(store), **row, "estimated_bytes": 101})
    store.purging.purge()
    with act_as(user("dora")):
        store.studies.insert({**_row(store), **row, "estimated_bytes": 1000})
    create(store, 1000)  # of nobody


def on_disk(store: Store) -> int:
    """Bytes of all studies, rows and indexes, as the database has them."""
    with store.session.read() as connection:
        if connection.dialect.name == "postgresql":
            return int(connection.execute(sa.text("SELECT pg_total_relation_size('studies')")).scalar_one())
        pages, size = (
            connection.execute(sa.text(f"PRAGMA {name}")).scalar_one() for name in ("page_count", "page_size")
        )
        return int(pages * size)


@pytest.mark.parametrize(
    "letters",
    ["abcdefghijklmnopqrstuvwxyz0123456789", "абвгґдеєжзиіїйклмнопрстуфхцчшщьюя"],
    ids=["Latin", "Ukrainian"],
)
def test_notes_count_as_they_lie_on_the_disk(store: Store, letters: str) -> None:
    """Of any alphabet; and nobody writes more of them than the quota allows."""
    store.people.add_user("dora", Role.DESIGNER)
    chance = random.Random(5)
    before = on_disk(store)
    notes = ["".join(chance.choices(letters, k=MAX_NOTES_LENGTH)) for _ in range(30)]
    with act_as(user("dora")):
        made = [create(store, 3) for _ in notes]
        for study, text in zip(made, notes, strict=True):
            store.studies.change(study.id, StudyChange(notes=text))
        taken = on_disk(store) - before
        # PostgreSQL packs long texts, and leaves room between them.
        most = 2.5 if store.session.on_server else 1.3
        assert 0.6 < store.people.usage("dora").bytes / taken < most
        store.people.change_user("dora", quota=Quota(bytes=store.people.usage("dora").bytes))
        with pytest.raises(FaultError, match="MiB more") as refused:
            store.studies.change(made[0].id, StudyChange(notes=notes[0] + "more"))
        assert refused.value.code == "quota-exceeded"
        assert store.studies.get(made[0].id).notes == notes[0]
        for shorter in (notes[0][:-1], "", notes[0]):
            assert store.studies.change(made[0].id, StudyChange(notes=shorter)).notes == shorter


def test_an_ended_study_is_restored_over_the_quota_of_cases(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER)
    store.studies.restorable = timedelta(days=1)
    with act_as(user("dora")):
        ended = create(store, 3)
        finish(store, ended)
        create(store, 30)
        store.studies.delete(ended.id)
        store.people.change_user("dora", quota=Quota(cases=10))
        store.studies.restore(ended.id)
    assert store.studies.get(ended.id).id == ended.id


def _row(store: Store) -> dict[str, Any]:
    from sprag_study.service.storage.studies.study_row import study_row

    return study_row({}, fakes.study(3), store.dispatchers.chunking)


def test_submissions_side_by_side_do_not_exceed_a_quota_together(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER, Quota(cases=100))

    def submit(_: int) -> bool:
        with act_as(user("dora")):
            try:
                create(store, 30)
            except FaultError:
                return False
            return True

    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(submit, range(16))) == 3
    assert store.people.usage("dora").cases == 90


def test_the_log_is_kept_as_long_as_told(store: Store, clock: fakes.HandClock) -> None:
    for _ in range(3):
        create(store)
        clock.seconds += 86_400.0
    assert store.audit.prune(store.clock.now() - timedelta(days=2)) == 1
    assert [row.action for row in store.audit.rows(AuditFilter())] == ["study.create", "study.create", "audit.delete"]
    assert store.audit.prune(store.clock.now() - timedelta(days=2)) == 0
    page = store.audit.page(AuditFilter(action="study.create"), 1)
    assert page.next_token is not None
    assert store.audit.page(AuditFilter(action="study.create"), 1, page.next_token).next_token is None


def test_tokens_have_an_end_and_a_last_use(store: Store, clock: fakes.HandClock) -> None:
    store.people.add_user("dora", Role.DESIGNER)
    end = store.clock.now() + timedelta(days=1)
    _, made = store.people.create_token("laptop", TokenScope.WRITE, owner="dora", expires_at=end)
    (dora,) = store.people.users()
    assert made.state_at(end - timedelta(microseconds=1), dora) == "valid"
    assert made.state_at(end, dora) == "expired"
    assert made.state_at(store.clock.now(), store.people.change_user("dora", removed=True)) == "user-removed"
    assert store.people.revoke_token(made.id).state_at(end, dora) == "revoked"
    for micros, expected in ((2_000_000, 2), (1_000_000, 2), (3_000_000, 3)):
        store.people.note_uses({made.id: micros, "tk_none": micros})
        (kept,) = store.people.tokens()
        assert kept.used_at is not None
        assert kept.used_at.timestamp() == expected
    assert (kept.owner, kept.expires_at) == ("dora", end)


def test_only_a_removed_user_is_restored_which_forgets_the_account(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER)
    account = Account("https://login.example", "0" * 64, "dora")
    other = Account("https://login.example", "1" * 64, "dora")
    signed_in = store.people.sign_in(account, None, create=False)
    assert store.people.change_user("dora", removed=False) == signed_in
    with pytest.raises(FaultError, match="Another account"):
        store.people.sign_in(other, None, create=False)
    assert store.people.change_user("dora", removed=True).session_salt != signed_in.session_salt
    store.people.change_user("dora", removed=True)
    store.people.change_user("dora", removed=False)
    store.people.sign_in(other, None, create=False)
    log = [(row.action, row.detail) for row in store.audit.rows(AuditFilter())]
    assert log == [
        ("user.add", {"role": "designer"}),
        ("user.change", {"login": True}),
        ("user.remove", {}),
        ("user.restore", {"account_forgotten": True}),
        ("user.change", {"login": True}),
    ]


def test_a_change_that_changes_nothing_is_no_row_and_a_contradiction_is_refused(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER, Quota(cases=7))
    before = actions(store)
    store.people.change_user("dora", Role.DESIGNER, Quota(cases=7))
    assert actions(store) == before
    with pytest.raises(FaultError) as refused:
        store.people.change_user("dora", quota=Quota(cases=5), as_set=["cases"])
    assert [fault.where for fault in refused.value.faults] == ["cases"]
    with pytest.raises(FaultError) as refused:
        store.people.hand_over("dora", "dora")
    assert [fault.where for fault in refused.value.faults] == ["to"]
    assert actions(store) == before


def test_renewing_tokens_is_no_way_past_the_limit(store: Store) -> None:
    store.people.add_user("dora", Role.DESIGNER)
    store.people.most_tokens = 3
    _, token = store.people.create_token("laptop", TokenScope.WRITE, owner="dora")
    for _ in range(2):
        _, token = store.people.renew_token(token.id, timedelta(days=1))
    with pytest.raises(FaultError, match="dora has 3 valid tokens"):
        store.people.renew_token(token.id, timedelta(days=1))
    (dora,) = store.people.users()
    now = store.clock.now()
    assert [made.state_at(now, dora) for made in store.people.tokens()] == ["valid"] * 3


def test_the_log_has_the_values_before_and_after(store: Store) -> None:
    made = create(store)
    store.studies.change(made.id, StudyChange(name="b", notes="n" * 600, tags=("x",)))
    view = store.views.save(View("studies", "mine", "owner=dora"))
    store.views.change(view.id, ViewChange(name="ours", query="owner=emil"))
    store.views.save(View("studies", "ours", "owner=ada"))
    for fields in ({"spring_rate": "9 N/mm"}, {"spring_rate": "8 N/mm", "mass": "1 kg"}):
        store.components.put([Component("spring", "F-120", "", fields)])
    log = {row.action: row.detail.get("changes") for row in store.audit.rows(AuditFilter())}
    assert log["component.change"] == {"spring_rate": ["9 N/mm", "8 N/mm"], "mass": [None, "1 kg"]}
    assert log["view.save"] == {"query": ["owner=emil", "owner=ada"]}
    assert log["study.change"] == {"name": [made.name, "b"], "notes": ["", "n" * 500 + "…"], "tags": [[], ["x"]]}
    assert log["view.change"] == {"name": ["mine", "ours"], "query": ["owner=dora", "owner=emil"]}
