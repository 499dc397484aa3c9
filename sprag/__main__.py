"""``python -m sprag``: the command line, whatever lies in the folder in which it is called."""

import os
import sys
from pathlib import Path


def _leave_folder_out() -> None:
    """Take the current folder off the path, which ``python -m`` puts first: a ``worker.py`` there is none of ours."""
    own = Path(__file__).resolve().parents[1]
    if sys.path and Path(sys.path[0] or os.curdir).resolve() == Path.cwd() != own:
        del sys.path[0]


if __name__ == "__main__":
    _leave_folder_out()
    from sprag.service.cli import main

    main()
