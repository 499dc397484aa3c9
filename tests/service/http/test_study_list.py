"""The list of studies over HTTP: searched, sorted, labelled, deleted and restored, by programs and on its page."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable
from typing import Any

import httpx
import pytest

from sprag_study.service.client import Client, RefusedError
from sprag_study.service.settings import Settings
from tests.service.conftest import API, PortalTransport, Service
from tests.service.http.people import OWN, Office
from tests.service.timed_spec import SPEC


@pytest.fixture
def three(service: Service) -> dict[str, str]:
    """Three studies, the second one ended."""
    made = {name: service.submit({**copy.deepcopy(SPEC), "name": name}) for name in ("feeder", "Zahnrad", "Äpfel")}
    service.fill(made["feeder"])
    return made


def names(service: Service, **query: Any) -> list[str]:
    return [study["name"] for study in service.get("/studies", **query)["studies"]]


def rows(text: str) -> list[str]:
    """Names of the studies on the page."""
    return re.findall(r'aria-label="Choose ([^"]*)"', text)


def test_a_list_is_searched_sorted_and_paged(service: Service, three: dict[str, str]) -> None:
    assert names(service) == ["Äpfel", "Zahnrad", "feeder"]
    assert names(service, sort="name") == ["Äpfel", "feeder", "Zahnrad"]
    assert names(service, sort="ended") == ["feeder", "Äpfel", "Zahnrad"]
    assert names(service, search="APF") == ["Äpfel"]
    assert names(service, state="finished", model=SPEC["model"]) == ["feeder"]
    first = service.http.get(f"{API}/studies", params={"sort": "name", "search": "e", "page_size": 1})
    following = re.fullmatch(r'<(.*)>; rel="next"', first.headers["link"])
    assert following
    second = service.http.get(following[1]).json()
    assert [study["name"] for study in first.json()["studies"] + second["studies"]] == ["Äpfel", "feeder"]
    token = first.json()["next_page_token"]
    for wrong in ({"sort": "age"}, {"model": "bicycle"}, {"page_token": token}, {"archived": "perhaps"}, {"q": "x"}):
        answer = service.http.get(f"{API}/studies", params=wrong)
        assert answer.status_code == 422, wrong
        assert answer.json()["errors"][0]["parameter"] == next(iter(wrong))


def test_a_study_is_named_tagged_and_archived(service: Service, three: dict[str, str]) -> None:
    address = f"{API}/studies/{three['Zahnrad']}"
    changed = service.http.patch(address, json={"name": "Stirnrad", "notes": "a\nb", "add_tags": ["one", "two"]}).json()
    assert (changed["name"], changed["notes"], changed["tags"]) == ("Stirnrad", "a\nb", ["one", "two"])
    assert names(service, tag="two") == names(service, search="stirn") == ["Stirnrad"]
    assert service.get(f"/studies/{three['Zahnrad']}")["spec"]["name"] == "Zahnrad"
    page = service.http.get(f"/studies/{three['Zahnrad']}").text
    assert "<h1>Stirnrad</h1>" in page
    assert 'value="one, two"' in page
    assert "Stirnrad (copy)" in service.http.get(f"/new?clone={three['Zahnrad']}").text
    gone = service.http.patch(address, json={"archived": True, "remove_tags": ["ONE"]}).json()
    assert (gone["tags"], gone["archived_at"] is None) == (["two"], False)
    assert names(service) == ["Äpfel", "feeder"]
    assert names(service, archived=True) == ["Stirnrad"]
    wrong = service.http.patch(address, json={"tags": ["a,b"], "colour": "red"})
    assert wrong.status_code == 422
    assert wrong.json()["type"] == "/problems/invalid-body"
    assert {item["pointer"] for item in wrong.json()["errors"]} == {"/tags/0", "/colour"}
    many = service.http.patch(address, json={"tags": [str(count) for count in range(20)], "add_tags": ["x"]})
    assert (many.status_code, many.json()["errors"][0]["code"]) == (422, "too-many")


def test_a_deletion_is_undone(service: Service, three: dict[str, str]) -> None:
    before = service.http.get(f"{API}/studies/{three['feeder']}/results?format=csv").content
    address = f"{API}/studies/{three['feeder']}"
    assert service.http.delete(address).status_code == 204
    assert service.http.get(address).status_code == 404
    assert names(service, deleted=True) == ["feeder"]
    service.store.purging.purge()
    restored = service.http.post(f"{address}:restore")
    assert (restored.status_code, restored.json()["purge_at"]) == (200, None)
    assert service.http.get(f"{address}/results?format=csv").content == before
    assert service.http.delete(address, params={"at_once": True}).status_code == 204
    assert service.http.post(f"{address}:restore").status_code == 404
    assert names(service, deleted=True) == []


def test_the_client_does_the_same(service: Service, three: dict[str, str]) -> None:
    transport = service.http._transport
    assert isinstance(transport, PortalTransport)
    with Client("http://127.0.0.1", transport=transport) as client:
        study = client.study(three["feeder"])
        assert study.change(name="faster", tags=["a"], archived=True)["tags"] == ["a"]
        assert [found["name"] for found in client.studies(archived=True, tag="a", sort="name")] == ["faster"]
        assert study.change(remove_tags=["a"], archived=False)["tags"] == []
        read = study.detail()["etag"]
        assert study.change(notes="first", etag=read)["notes"] == "first"
        with pytest.raises(RefusedError) as refused:
            study.change(notes="second", etag=read)
        assert refused.value.status == 412
        with pytest.raises(RefusedError):
            study.delete(etag=read)
        study.delete()
        assert [found["id"] for found in client.studies(deleted=True)] == [study.id]
        assert study.restore()["name"] == "faster"
        study.delete(at_once=True)
        assert [found["name"] for found in client.studies(search="faster")] == []


def test_the_page_lists_what_is_asked_for(service: Service, three: dict[str, str]) -> None:
    service.http.patch(f"{API}/studies/{three['Zahnrad']}", json={"tags": ["night & day"], "notes": "loud"})
    assert rows(service.http.get("/").text) == ["Äpfel", "Zahnrad", "feeder"]
    assert rows(service.http.get("/?search=&state=&tag=&model=&sort=name").text) == ["Äpfel", "feeder", "Zahnrad"]
    tagged = service.http.get("/", params={"tag": "night & day"}).text
    assert rows(tagged) == ["Zahnrad"]
    assert 'href="/?tag=night+%26+day"' in tagged
    sorted_by = service.http.get("/?sort=ended&state=queued").text
    assert rows(sorted_by) == ["Äpfel", "Zahnrad"]
    assert '<option value="ended" selected>' in sorted_by
    assert '<option value="queued" selected>' in sorted_by
    assert "No study matches." in service.http.get("/?search=nothing").text
    for wrong in ("state=odd", "sort=odd", "model=odd", "after=odd"):
        assert service.http.get(f"/?{wrong}").status_code == 422, wrong


def test_buttons_of_the_page_change_many_studies(service: Service, three: dict[str, str]) -> None:
    service.fill(three["Zahnrad"])

    def press(do: str, *chosen: str, query: str = "", **fields: str) -> httpx.Response:
        answer = service.http.post(
            f"/studies{query}", data={"do": do, "study": [three[name] for name in chosen], **fields}
        )
        if answer.status_code == 303:
            return service.http.get(answer.headers["location"])
        return answer

    done = press("tag", "feeder", "Äpfel", tags="night, day")
    assert "2 studies are tagged." in done.text
    assert names(service, tag="day") == ["Äpfel", "feeder"]
    press("untag", "feeder", tags="day")
    assert names(service, tag="day") == ["Äpfel"]
    assert press("tag", "feeder", tags="x" * 50).status_code == 422
    for do in ("tag", "untag"):
        without = press(do, "feeder", tags=" ,")
        assert without.status_code == 422
        assert "No tag was typed: nothing has changed." in without.text
        assert f'value="{three["feeder"]}" checked' in without.text
    done = press("archive", "Äpfel", query="?tag=day")
    assert ("1 study is archived." in done.text, rows(done.text)) == (True, [])
    assert 'value="unarchive">Undo' in done.text
    press("unarchive", "Äpfel")
    refused = press("delete", "feeder", "Äpfel", query="?sort=name")
    assert refused.status_code == 409
    assert "1 of the chosen studies was not changed" in refused.text
    assert "cancel it before it is deleted" in refused.text
    assert rows(refused.text) == ["Äpfel", "Zahnrad"]
    deleted = service.http.get("/?deleted=true").text
    assert rows(deleted) == ["feeder"]
    assert 'value="restore"' in deleted
    assert f'href="/studies/{three["feeder"]}"' not in deleted
    assert "1 study is restored." in press("restore", "feeder", query="?deleted=true").text
    assert names(service) == ["Äpfel", "Zahnrad", "feeder"]
    assert press("explode", "feeder").status_code == 422
    nothing = press("archive")
    assert "No study was chosen: nothing has changed." in nothing.text
    assert rows(nothing.text) == ["Äpfel", "Zahnrad", "feeder"]


def test_the_address_of_the_list_cannot_lead_elsewhere(service: Service, three: dict[str, str]) -> None:
    answer = service.http.post(
        "/studies?back=//evil.example&done=//x", data={"do": "archive", "study": three["feeder"]}
    )
    assert answer.headers["location"] == f"/?done=archive&changed={three['feeder']}"
    shown = service.http.get("/?done=delete&changed=%22%3E%3Cscript%3E")
    assert "<script>" not in shown.text.replace("<script defer", "")


def test_the_page_of_a_study_has_a_form_for_its_labels(service: Service, three: dict[str, str]) -> None:
    address = f"/studies/{three['feeder']}"
    fields = {"name": "Feeder 2", "notes": "two\r\nlines", "tags": "a,  b ,", "archived": "true"}
    assert service.http.post(f"{address}/labels", data=fields).headers["location"] == address
    detail = service.get(address)
    assert (detail["name"], detail["notes"], detail["tags"]) == ("Feeder 2", "two\nlines", ["a", "b"])
    assert detail["archived_at"] is not None
    service.http.post(f"{address}/labels", data={**fields, "archived": ""} | {"name": "Feeder 3"})
    del fields["archived"]
    service.http.post(f"{address}/labels", data=fields)
    assert service.get(address)["archived_at"] is None
    assert service.http.post(f"{address}/labels", data={"name": "x" * 300}).status_code == 422


def test_deleting_on_the_page_says_how_long_it_can_be_undone(service: Service, three: dict[str, str]) -> None:
    address = f"/studies/{three['feeder']}"
    page = service.http.get(f"{address}/delete").text
    assert "can be restored for 7 days" in page
    assert f'formaction="{address}/delete?at_once=true"' in page
    done = service.http.post(f"{address}/delete")
    assert done.headers["location"] == f"/?done=delete&changed={three['feeder']}"
    assert 'value="restore">Undo' in service.http.get(done.headers["location"]).text
    service.http.post(f"{API}{address}:restore")
    assert service.http.post(f"{address}/delete?at_once=true").headers["location"] == "/"
    assert names(service, deleted=True) == []


def test_what_cannot_be_restored_is_deleted_on_its_own_page_only(
    service: Service, settings: Settings, three: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(vars(settings), "restore_days", 0)
    assert 'value="delete"' not in service.http.get("/").text
    refused = service.http.post("/studies", data={"do": "delete", "study": three["feeder"]})
    assert (refused.status_code, names(service, search="feeder")) == (422, ["feeder"])
    done = service.http.get(f"/?done=delete&changed={three['feeder']}").text
    assert "1 study is deleted." in done
    assert "Undo" not in done


def test_what_belongs_to_somebody_stays_theirs(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client]
) -> None:
    office = Office(settings, service, connect)
    dora, ada, vera = (office.program(name) for name in ("dora", "ada", "vera"))
    made = ada.post(f"{API}/studies", json=SPEC).json()["id"]
    assert dora.patch(f"{API}/studies/{made}", json={"name": "mine"}).status_code == 403
    answer = dora.post("/studies", data={"do": "archive", "study": made}, headers=OWN)
    assert answer.status_code == 409
    assert "belongs to ada" in answer.text
    assert vera.post("/studies", data={"do": "archive", "study": made}, headers=OWN).status_code == 403
    assert 'name="do"' not in vera.get("/").text
    assert rows(vera.get("/?owner=ada").text) == [SPEC["name"]]
    assert rows(vera.get("/?owner=dora").text) == []
