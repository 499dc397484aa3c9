"""The settings in the audit log: at each start of a service, those that differ from its last one."""

from __future__ import annotations

import logging
import socket
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.actor import Actor, Door, act_as
from sprag_study.service.settings import Settings, effective
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.storage.people.audit import AuditFilter

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.service.settings import EffectiveSetting
    from sprag_study.service.storage.store import Store

_LOG = logging.getLogger("sprag.service")
_ACTION: Final = "settings.change"


def note_settings(store: Store, settings: Iterable[EffectiveSetting]) -> None:
    """Write down what changed since the last start of a service on this machine; secrets only as such.

    The log itself says what was set: the first start, and one after rows were deleted, has what is no default.
    """
    host = socket.gethostname()
    before: dict[str, Any] = {default.name: default.value for default in effective(Settings.model_construct())}
    try:
        for row in store.audit.rows(AuditFilter(action=_ACTION, target=host)):
            before |= {name: pair[1] for name, pair in row.detail["changes"].items()}
        now = {setting.name: setting.value for setting in settings}
        changes = {name: [before.get(name), value] for name, value in now.items() if before.get(name) != value}
        if changes:
            with act_as(Actor(Door.SERVICE, "start", host)):
                store.audit.note(_ACTION, host, changes=changes)
    except StoreError as error:
        _LOG.warning("The settings are not in the audit log: %s", error)
