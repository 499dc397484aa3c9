"""The command line: ``sprag``. Its entry is `main`; each module holds the commands of one subject."""

from service.cli.app import main

__all__ = ["main"]
