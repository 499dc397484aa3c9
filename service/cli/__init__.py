"""The command line: ``sprag``. Its entry is `main`; each module contains the commands of one subject."""

import os
import signal
import sys
from typing import NoReturn


def _replace_closed_streams() -> None:
    """Put something in the place of standard streams that are closed, whose numbers files opened later would have.

    There is nothing to read. Standard output becomes a pipe whose reader went away, which commands expect; what is said
    on standard error is dropped.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is not None:
            continue
        if name == "stdout":
            reader, opened = os.pipe()
            os.close(reader)
        else:
            opened = os.open(os.devnull, os.O_RDWR)
        os.dup2(opened, number)
        if opened != number:
            os.close(opened)
        setattr(sys, name, os.fdopen(number, "r" if name == "stdin" else "w", encoding="utf-8"))


def main() -> NoReturn:
    """Run the command of the process' arguments and end the process with its exit code."""
    # SIGTERM and SIGHUP end a command cleanly, as Ctrl-C does: files, processes and studies are cleaned up. Signals
    # ignored under nohup stay ignored.
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    try:
        _replace_closed_streams()
        from sprag_study.service.cli.app import execute

        code = execute(sys.argv[1:])
    except KeyboardInterrupt:  # while the program is still being loaded, or already done
        code = 130
    sys.exit(code)


__all__ = ["main"]
