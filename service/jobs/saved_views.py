"""Saving and changing views: a figure of a report must be one that its study has."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.service.report.chosen_figures import require_figure

if TYPE_CHECKING:
    from collections.abc import Collection

    from sprag_study.service.spec.saved_views import View, ViewChange
    from sprag_study.service.storage.saved_views import SavedView
    from sprag_study.service.storage.store import Store


def save_view(store: Store, view: View) -> SavedView:
    """Save a view; raises as the store does, and SelectionError for a figure that the study does not have."""
    if view.in_report and view.study is not None:
        require_figure(store.studies.study(view.study), view)
    return store.views.save(view)


def change_view(store: Store, view_id: str, change: ViewChange, read: Collection[str] | None = None) -> SavedView:
    """Change a view; raises as the store does, and SelectionError for a figure that the study does not have."""
    old = store.views.get(view_id).view
    in_report = change.place is not None or (old.in_report if change.in_report is None else change.in_report)
    if in_report and old.study is not None and not (old.in_report and change.query is None):
        query = old.query if change.query is None else change.query
        require_figure(store.studies.study(old.study), replace(old, query=query))
    return store.views.change(view_id, change, read)
