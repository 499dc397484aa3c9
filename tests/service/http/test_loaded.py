"""What the service's own process loads: no compiler and nothing that computes, which the processes beside it have."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

SCRIPT = """
import asyncio, sys
import httpx
from sprag_study.service.http.app import create_app
from sprag_study.service.settings import Settings
from sprag_study.worker import models

async def look():
    app = create_app(Settings(database=sys.argv[1]), computer=object(), checker=object())
    async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
        for path in ("/", "/new?mode=text", "/nights", "/parts", "/api/v1/presets", "/api/v1/models"):
            answer = await client.get(path)
            assert answer.status_code == 200, (path, answer.text)

asyncio.run(look())
models.cache_folder()
print(sorted({"numba", "llvmlite", "scipy.stats", "scipy.optimize", "matplotlib", "pandas"} & set(sys.modules)))
"""


def test_the_first_page_loads_nothing_that_computes(tmp_path: Path) -> None:
    """That took seconds, in which the service answered nobody."""
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "sprag.sqlite3")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stdout + done.stderr


#: What the processes beside it have of pint: the libraries that it would load stay loadable.
UNITS = """
import sys
from sprag_study.service.reading import units
units.load()
print(sorted({"dask", "uncertainties", "xarray"} & set(sys.modules)))
import dask
"""


def test_units_load_no_other_library() -> None:
    done = subprocess.run([sys.executable, "-c", UNITS], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stdout + done.stderr
