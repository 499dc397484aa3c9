"""Every view of a study."""

from __future__ import annotations

from typing import Any, Final

from sprag_study.service.views.answers import AnswersView
from sprag_study.service.views.calibration import CalibrationView
from sprag_study.service.views.curves import CurvesView, MapView
from sprag_study.service.views.drives import RibbonView, YieldView
from sprag_study.service.views.explore import ExploreView
from sprag_study.service.views.front import FrontView
from sprag_study.service.views.sensitivity import SensitivityView
from sprag_study.service.views.study_view import StudyView

#: By name, in the order of the API.
STUDY_VIEWS: Final[dict[str, StudyView[Any, Any, Any]]] = {
    view.about.name: view
    for view in (
        CurvesView(), MapView(), SensitivityView(), RibbonView(), YieldView(), CalibrationView(), FrontView(),
        ExploreView(), AnswersView(),
    )
}  # fmt: skip
