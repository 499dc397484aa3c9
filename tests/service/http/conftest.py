"""Fixtures of the tests of answers over HTTP."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest
from pydantic import SecretStr

from sprag_study.service.http import access
from sprag_study.service.http.app import create_app
from sprag_study.service.http.attempts import Attempts
from tests.service.http.openid import CLIENT, Openid, openid
from tests.service.http.people import Office

if TYPE_CHECKING:
    import httpx

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service


@pytest.fixture
def ended(service: Service, spec: dict[str, Any]) -> str:
    """A study of twelve cases that has ended."""
    spec["axes"] = [{"path": "shaft.load", "linspace": [0.01, 0.5, 12]}]
    study_id = service.submit(spec)
    service.fill(study_id)
    return study_id


@pytest.fixture
def with_token(service: Service, settings: Settings, connect: Callable[..., httpx.Client]) -> Service:
    """The service with SPRAG_TOKEN, whose client sends it: one without a login takes no first user from programs."""
    token = "correct-horse-battery-staple"
    guarded = settings.model_copy(update={"token": SecretStr(token)})
    app = create_app(
        guarded, store=service.store, computer=service.computer, checker=service.checker, writer=service.writer
    )
    return replace(service, app=app, http=connect(app, headers={"Authorization": f"Bearer {token}"}))


@pytest.fixture
def provider() -> Iterator[Openid]:
    with openid() as started:
        yield started


@pytest.fixture
def opened(
    settings: Settings, service: Service, connect: Callable[..., httpx.Client], provider: Openid
) -> Callable[..., Office]:
    """An office whose people log in at the provider."""
    usual = {
        "oidc_issuer": provider.issuer, "oidc_client_id": CLIENT, "oidc_client_secret": SecretStr("s+e:cret"),
        "oidc_roles": ("cad=designer", "it=administrator"), "oidc_create": True,
    }  # fmt: skip
    return lambda **more: Office(settings, service, connect, **{**usual, **more})


@pytest.fixture
def believing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Users and tokens are read anew for each request."""
    monkeypatch.setattr(access, "BELIEVED_SECONDS", 0.0)


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Seconds for which failed attempts wait; none of them does."""
    waited: list[float] = []

    async def wait(self: Attempts, scope: object, place: str) -> None:
        waited.append(0.0)

    monkeypatch.setattr(Attempts, "failed", wait)
    return waited
