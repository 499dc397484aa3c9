"""All rows of a study as a pandas table: `study.table()` against `curl` and `pandas.read_parquet`, in turns.

Builds its own database of synthetic rows of one pendulum, then starts `sprag serve` on it. The file of at most 100,000
cases is made once, before the first turn; that of more is made by the service for every request.

    python -m benchmarks.frames [--cases 1000000] [--turns 3]
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import tempfile
from pathlib import Path

import pandas as pd

import sprag_study as sprag
from benchmarks.at_once import timed
from benchmarks.reading import build, grid, serving

#: Files of more cases are not kept by the service (docs/http.md).
KEPT_CASES = 100_000


def main() -> None:
    """Print the seconds of each turn and the ratio of their medians."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--turns", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study = grid(options.cases)
        study_id, _ = build(Path(folder) / "studies.db", study)
        file = Path(folder) / "rows.parquet"
        with serving(Path(folder) / "studies.db") as (address, _), sprag.Client(address) as client:
            remote = client.study(study_id)
            url = f"{address}/api/v1/studies/{study_id}/results?format=parquet"

            def by_curl() -> pd.DataFrame:
                subprocess.run(["curl", "--silent", "--fail", "--output", file, url], check=True)
                return pd.read_parquet(file)

            ways = {"curl, pandas.read_parquet": by_curl, "study.table()": remote.table}
            seconds: dict[str, list[float]] = {name: [] for name in ways}
            if options.cases <= KEPT_CASES:
                by_curl()
            for turn in range(options.turns):
                tables = []
                for name in list(ways) if turn % 2 == 0 else reversed(ways):
                    took, table = timed(ways[name])
                    seconds[name].append(took)
                    tables.append(table)
                pd.testing.assert_frame_equal(*tables)
        print(f"{study.cases:,} cases, {len(tables[0].columns)} columns, {file.stat().st_size / 1e6:,.0f} MB")
    for name, each_turn in seconds.items():
        turns = ", ".join(f"{took:.1f}" for took in each_turn)
        print(f"{name:26} {statistics.median(each_turn):6.1f} s   ({turns})")
    first, second = map(statistics.median, seconds.values())
    print(f"ratio {second / first:.2f}")


if __name__ == "__main__":
    main()
