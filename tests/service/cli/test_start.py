"""The command line starts quickly: what only some commands need is loaded by them."""

import subprocess
import sys

#: Libraries that take longer to load than the command line itself.
HEAVY = ("fastapi", "httpx", "matplotlib", "numba", "numpy", "pint", "scipy", "sqlalchemy", "xarray")


#: What processes of the service load only where a study needs it.
LATER = ("matplotlib", "numba", "pandas", "scipy", "xarray")


def test_the_command_line_and_the_store_load_no_heavy_library() -> None:
    code = "import sys\n" + "\n".join(
        f"import {module}; print([name for name in {names!r} if name in sys.modules])"
        for module, names in (("sprag_study.service.cli.app", HEAVY), ("sprag_study.service.storage.store", LATER))
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["[]", "[]"]


def test_help_is_shown_without_what_draws_tables() -> None:
    code = (
        "import sys; from sprag_study.service.cli.app import execute; "
        "print(execute(['--help']), [name for name in ('pygments', 'rich') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"
