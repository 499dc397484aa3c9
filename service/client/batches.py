"""Ribbons and yields as pandas tables. pandas is loaded on first use."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sprag_study.service.extras import naming_extra

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from sprag_study.service.answers.tolerances import CausesInfo, RibbonReport, YieldReport


@dataclass(frozen=True, slots=True, repr=False)
class Ribbon:
    """Quantiles over the drives along an axis; ``data`` is the answer of the service. SI units."""

    data: RibbonReport

    def __repr__(self) -> str:
        return f"Ribbon({_shown(self.data['lines'])}, quantiles={self.data['quantiles']})"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each place, result and quantile: parameters, nominal, value, low, high, drives, failed, case."""
        with naming_extra("Ribbon.to_pandas", "tables"):
            import pandas as pd

        rows: list[dict[str, Any]] = []
        for line in self.data["lines"]:
            for place, case in enumerate(line["cases"]):
                fixed = {**line["by"], **line["at"], **_x_of(self.data, line["x"], place)}
                for name, result in line["results"].items():
                    for index, probability in enumerate(self.data["quantiles"]):
                        parts = {part: result[part][index][place] for part in ("values", "low", "high")}
                        counts = {"drives": result["drives"][place], "failed": line["failed"][place], "case": case}
                        nominal = {"nominal": result["nominal"][place]}
                        made = {**fixed, "result": name, "quantile": probability, **nominal, **parts, **counts}
                        rows.append(made)
        table = pd.DataFrame(rows).rename(columns={"values": "value"})
        table.attrs["units"] = _units_of(self.data)
        return table.astype(dict.fromkeys(("nominal", "value", "low", "high"), "float64"))

    def causes(self) -> pd.DataFrame:
        """A row for each line, result and tolerance: its share of the variance and the half width of its interval."""
        return _causes([({**line["by"], "result": name}, result["causes"])
                        for line in self.data["lines"] for name, result in line["results"].items()])  # fmt: skip


@dataclass(frozen=True, slots=True, repr=False)
class Yield:
    """Yields along an axis; ``data`` is the answer of the service. SI units."""

    data: YieldReport

    def __repr__(self) -> str:
        return f"Yield({_shown(self.data['lines'])})"

    def to_pandas(self) -> pd.DataFrame:
        """A row for each place: parameters, reached, drives, yield, low, high, failed, case of the nominal drive."""
        with naming_extra("Yield.to_pandas", "tables"):
            import pandas as pd

        rows = [
            {
                **line["by"],
                **line["at"],
                **_x_of(self.data, line["x"], place),
                **share,
                "failed": line["failed"][place],
                "case": line["cases"][place],
            }
            for line in self.data["lines"]
            for place, share in enumerate(line["each"])
        ]
        table = pd.DataFrame(rows).rename(columns={"value": "yield"})
        table.attrs["units"] = _units_of(self.data)
        return table.astype(dict.fromkeys(("yield", "low", "high"), "float64"))

    def causes(self) -> pd.DataFrame:
        """A row for each line and tolerance: its share of the variance of reaching the conditions everywhere."""
        return _causes([(dict(line["by"]), line["causes"]) for line in self.data["lines"]])

    def worst(self) -> pd.DataFrame:
        """A row for each of the worst drives: line, drive, case, place, margin, results, and its draws."""
        with naming_extra("Yield.worst", "tables"):
            import pandas as pd

        rows = [
            {**line["by"], "drive": one["drive"], "case": one["case"], **_place(self.data, one),
             "margin": one["margin"], **one["results"], **one["draws"]}
            for line in self.data["lines"] for one in line["worst"]
        ]  # fmt: skip
        return pd.DataFrame(rows)


def _shown(lines: Sequence[Any]) -> str:
    """How many lines an answer has, with how many places."""
    return f"lines={len(lines)}, places={len(lines[0]['x']) if lines else 0}"


def _place(data: YieldReport, one: Any) -> dict[str, float]:
    return {data["x"]["path"]: one["x"]} if data["x"] is not None else {}


def _x_of(data: RibbonReport | YieldReport, x: list[float], place: int) -> dict[str, float]:
    return {} if data["x"] is None else {data["x"]["path"]: x[place]}


def _units_of(data: RibbonReport | YieldReport) -> dict[str, str]:
    return dict(data["units"])


def _causes(parts: list[tuple[dict[str, Any], CausesInfo]]) -> pd.DataFrame:
    with naming_extra("causes", "tables"):
        import pandas as pd

    return pd.DataFrame([{**about, **share} for about, causes in parts for share in causes["shares"]])
