"""The command line: ``sprag``. Its entry is `main`; each module contains the commands of one subject."""

import signal
import sys
from typing import NoReturn


def main() -> NoReturn:
    """Run the command of the process' arguments and end the process with its exit code."""
    # SIGTERM and SIGHUP end a command cleanly, as Ctrl-C does: files, processes and studies are cleaned up. Signals
    # ignored under nohup stay ignored.
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    try:
        from sprag.service.cli.app import execute

        code = execute(sys.argv[1:])
    except KeyboardInterrupt:  # while the program is still being loaded, or already done
        code = 130
    sys.exit(code)


__all__ = ["main"]
