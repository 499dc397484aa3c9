"""A study of a service and the same study here, for tests of what both answer."""

from __future__ import annotations

from typing import Any

import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.client import Client, Study
from sprag_study.service.here import Here
from sprag_study.service.settings import Settings
from sprag_study.service.storage.studies.records import StudyRecord
from tests.service.conftest import PortalTransport, Service


class OfService(Here):
    """The database of a service of a test."""

    def run(self, record: StudyRecord) -> StudyRecord:
        """Nothing: the test fills in the rows."""
        return record


@pytest.fixture
def pair(service: Service, portal: BlockingPortal, settings: Settings, spec: dict[str, Any]) -> tuple[Study, Study]:
    """A study of a service, and the same one here."""
    study_id = service.submit(spec)
    service.fill(study_id)
    client = Client("http://localhost", transport=PortalTransport(service.app, portal))
    return Study(client, study_id), Study(OfService(service.store, settings), study_id)
