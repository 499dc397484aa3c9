"""Workers of Sprag as jobs of Slurm, PBS or SGE: a Dask scheduler here, and jobs that are replaced when they end.

    pip install "${SPRAG}[cluster]" dask-jobqueue
    python job_queue.py slurm --host head.example --jobs 8 --cores 32 --memory "64 GiB" --time 08:00:00
    SPRAG_EXECUTOR=dask://head.example:8786 sprag serve

Run it where jobs are submitted; Ctrl-C ends the scheduler and the jobs. `--print` shows the script of a job and submits
nothing. Certificates come from Dask's configuration: docs/deployment.md, "A Dask cluster".
"""

from __future__ import annotations

import argparse
import shlex
import signal
import sys
import threading
from typing import Any

import dask
from dask.utils import parse_bytes
from dask_jobqueue import PBSCluster, SGECluster, SLURMCluster
from distributed import Security

SYSTEMS = {"slurm": SLURMCluster, "pbs": PBSCluster, "sge": SGECluster}
#: Seconds between two looks for jobs that have ended.
LOOK_SECONDS = 5.0


def word(text: str) -> str:
    """A value without blanks, as the lines of a job's script need it."""
    if not text or text.split() != [text]:
        raise argparse.ArgumentTypeError(f"{text!r} must be one word")
    return text


def positive(text: str) -> int:
    """A number of cores or jobs."""
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} must be a whole number from 1")
    return int(text)


def memory(text: str) -> str:
    """An amount of memory as Dask reads it."""
    try:
        parse_bytes(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} must be an amount such as '64 GiB'") from None
    return text


def options() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description="Workers of Sprag as jobs of a batch system.")
    parser.add_argument("system", choices=SYSTEMS)
    parser.add_argument("--host", type=word, required=True, help="name or address by which jobs reach this machine")
    parser.add_argument("--port", type=int, default=8786, help="port of the scheduler")
    parser.add_argument("--jobs", type=positive, default=1, help="jobs that run at the same time")
    parser.add_argument("--cores", type=positive, required=True, help="cores of a job; each gets a worker")
    parser.add_argument("--memory", type=memory, required=True, help='memory of a job, such as "64 GiB"')
    parser.add_argument("--time", type=word, default="08:00:00", help="time limit of a job")
    parser.add_argument("--queue", type=word, help="queue or partition")
    parser.add_argument("--account", type=word, help="account or project that pays")
    parser.add_argument("--directive", action="append", default=[], help="further directive, as the system writes it")
    parser.add_argument("--python", default=sys.executable, help="python of the jobs; default: this one")
    parser.add_argument("--print", action="store_true", help="print the script of a job and end")
    return parser.parse_args()


def cluster(chosen: argparse.Namespace) -> Any:
    """The scheduler, and the description of its jobs; nothing is submitted yet.

    A scheduler on the loopback address goes without certificates, unless Dask's configuration requires encryption.
    """
    loopback = chosen.host in ("localhost", "127.0.0.1")
    plain = loopback and not dask.config.get("distributed.comm.require-encryption")
    return SYSTEMS[chosen.system](
        job_name="sprag",
        cores=chosen.cores,
        processes=chosen.cores,  # a worker for each core, because a worker runs one chunk at a time
        memory=chosen.memory,
        walltime=chosen.time,
        queue=chosen.queue,
        **{"project" if chosen.system == "sge" else "account": chosen.account},
        job_extra_directives=chosen.directive,
        # On the disk of the node: nodes may have different processors, and locks of network file systems are slow. A
        # folder of the job alone, which belongs to this user, because the files in it are executed.
        job_script_prologue=[
            'export SPRAG_KERNEL_CACHE="$(mktemp -d)"',
            "trap 'rm -rf \"$SPRAG_KERNEL_CACHE\"' EXIT",
        ],
        worker_extra_args=["--no-dashboard", "--memory-limit", "0"],
        python=shlex.quote(chosen.python),
        security=None if plain else Security(require_encryption=True),
        protocol="tcp://" if plain else "tls://",
        scheduler_options={
            "host": chosen.host,
            "port": chosen.port,
            "dashboard": False,
            "dashboard_address": "127.0.0.1:0",
        },
    )


def main() -> None:
    """Keep the jobs running until a signal comes."""
    chosen = options()
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ending.set())
    try:
        starting = cluster(chosen)
    except (OSError, RuntimeError, TypeError, ValueError) as error:
        cause: BaseException = error
        while (
            before := cause.__cause__ or cause.__context__
        ) is not None:  # Dask's own failures come on top of the first
            cause = before
        sys.exit(f"job_queue.py: the scheduler cannot start at {chosen.host}:{chosen.port}: {cause}")
    with starting as started:
        if chosen.print:
            print(started.job_script())
            return
        print(f"SPRAG_EXECUTOR=dask://{chosen.host}:{chosen.port}", flush=True)
        while not ending.is_set():
            started.scale(jobs=chosen.jobs)  # submits the jobs that are missing, at first all of them
            ending.wait(LOOK_SECONDS)


if __name__ == "__main__":
    main()
