"""The command line starts quickly: what only some commands need is loaded by them."""

import subprocess
import sys

#: Libraries that take longer to load than the command line itself.
HEAVY = ("fastapi", "httpx", "matplotlib", "numba", "numpy", "pint", "plotly", "scipy", "sqlalchemy", "xarray")


def test_the_command_line_loads_no_heavy_library() -> None:
    code = f"import sys, sprag.service.cli.app; print(*[name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []
