"""Results of cases with many starts: those of a settled case, and those of a regime among the others."""

from sprag_study.engine.catalogue import ResultInfo
from sprag_study.engine.vibration_drive.regimes import settled_infos

#: Result that numbers the rows of a case.
NUMBER = "regime.number"
#: Results of a regime among those of its case.
REGIME_INFOS = (
    ResultInfo(NUMBER, "1", "number of the regime among those of its case: 0 is the most frequent", "count"),
    ResultInfo("regime.count", "1", "regimes to which the starts of the case come", "count"),
    ResultInfo("regime.share", "1", "share of all starts of the case that come to the regime"),
    ResultInfo("regime.share.low", "1", "lower end of the 95 % interval of regime.share"),
    ResultInfo("regime.share.high", "1", "upper end of the 95 % interval of regime.share"),
    ResultInfo("regime.share.least", "1", "smallest regime.share of the case"),
    ResultInfo("regime.start", "1", "number of the first start that comes to the regime; 0 is the case's own", "count"),
    ResultInfo("starts.failed", "1", "starts of the case that did not end ok", "count"),
)


def started_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of a case with starts: those of a settled case, of a start's own, and those of its regime."""
    return (*settled_infos(pendulums), *REGIME_INFOS)
