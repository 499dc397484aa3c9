"""``python -m sprag_study``: the command line, independent of the files in the current folder."""

import os
import sys
from pathlib import Path


def _leave_folder_out() -> None:
    """Remove the current folder from the path, where ``python -m`` puts it first; a ``worker.py`` there is not ours."""
    own = Path(__file__).resolve().parents[1]
    if sys.path and Path(sys.path[0] or os.curdir).resolve() == Path.cwd() != own:
        del sys.path[0]


if __name__ == "__main__":
    _leave_folder_out()
    from sprag_study.service.cli import main

    main()
