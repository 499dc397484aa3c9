"""Every view of a case."""

from __future__ import annotations

from typing import Any, Final

from sprag_study.service.views.basin import BasinView
from sprag_study.service.views.branch import BranchView
from sprag_study.service.views.case_view import CaseView
from sprag_study.service.views.duty import DutyView
from sprag_study.service.views.engagements import EngagementsView
from sprag_study.service.views.forces import ForcesView
from sprag_study.service.views.portrait import StrobesView
from sprag_study.service.views.sections import DiagramView, SectionView
from sprag_study.service.views.speeds import SpeedsView
from sprag_study.service.views.start_up import StartUpView
from sprag_study.service.views.trajectory import TrajectoryView
from sprag_study.service.views.transient import TransientView

#: By name, in the order of the API.
CASE_VIEWS: Final[dict[str, CaseView[Any, Any, Any]]] = {
    view.about.name: view
    for view in (
        TrajectoryView(), EngagementsView(), DutyView(), ForcesView(), StrobesView(), BranchView(), DiagramView(),
        SectionView(),
        BasinView(), StartUpView(), SpeedsView(), TransientView(),
    )
}  # fmt: skip
