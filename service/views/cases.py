"""Every view of a case."""

from __future__ import annotations

from typing import Any, Final

from sprag.service.views.basin import BasinView
from sprag.service.views.branch import BranchView
from sprag.service.views.case_view import CaseView
from sprag.service.views.engagements import EngagementsView
from sprag.service.views.portrait import StrobesView
from sprag.service.views.sections import DiagramView, SectionView
from sprag.service.views.trajectory import TrajectoryView
from sprag.service.views.transient import TransientView

#: By name, in the order of the API.
CASE_VIEWS: Final[dict[str, CaseView[Any, Any, Any]]] = {
    view.about.name: view
    for view in (
        TrajectoryView(), EngagementsView(), StrobesView(), BranchView(), DiagramView(), SectionView(), BasinView(),
        TransientView(),
    )
}  # fmt: skip
