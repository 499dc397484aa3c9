"""Code for several instruction sets on this machine: equal bits, and relative speeds.

Compiled code is for each instruction set, and numpy and the C library choose theirs as on a processor without vectors
of 256 bits. Each code runs in its own process; they compute in turn, so that slow phases of the machine affect all of
them. The least processor time of a workload counts. Code without fused multiply-adds calls a function for each of them
and is very slow, so it computes a few cases only.

    python -m benchmarks.processors [--repeats 5] [--plain] [--cases 512]
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from benchmarks.workloads import CASES, W1, W2, Workload
from sprag_study.engine.run import Run, SettledRun, Span

ROOT = Path(__file__).resolve().parents[1]
_WORKLOADS = {workload.name: workload for workload in (W1, W2)}
#: Batch sizes for the compared cases, and the number of these cases.
_BATCHES = (1, 7, 40)
_COMPARED = 48
_PRESET_CASES = 12
#: Everything beyond SSE 4.2.
_BEYOND_SSE = ("avx", "amx", "evex", "fma", "f16c", "vaes", "vpclmul", "xop", "gfni", "sha512", "sm3", "sm4")
_BEYOND_AVX2 = ("avx512", "avx10", "evex512", "amx")


def features(without: tuple[str, ...] = (), *more: str) -> str:
    """The features of this processor without those whose names begin so, and with some more."""
    has = llvm.get_host_cpu_features()
    own = [f"{'+' if there and not name.startswith(without) else '-'}{name}" for name, there in has.items()]
    return ",".join([*own, *more])


def codes(plain: bool) -> dict[str, dict[str, str]]:
    """The environment of each code that this machine can run, by its name; the first is what Sprag chooses."""
    has = llvm.get_host_cpu_features()
    found: dict[str, dict[str, str]] = {"chosen": {}}
    if has.get("avx512f"):
        found["512 bits"] = {"NUMBA_CPU_FEATURES": features((), "-prefer-256-bit")}
        found["256 bits"] = {"NUMBA_CPU_FEATURES": features((), "+prefer-256-bit")}
    if has.get("avx2"):
        found["AVX2"] = {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": features(_BEYOND_AVX2)}
    if has.get("sse2"):
        found["SSE"] = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": features(_BEYOND_SSE)}
    libraries = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F"}
    if chosen := np.show_config(mode="dicts")["SIMD Extensions"].get("found"):
        libraries["NPY_DISABLE_CPU_FEATURES"] = " ".join(chosen)
    found["libraries"] = libraries
    if plain:
        found["plain numba"] = {"SPRAG_COMPILER": "plain"}
    return found


def _bits(workload: Workload, settled: bool) -> str:
    """A hash of all results of some cases, computed in batches of several sizes, which must agree."""
    from sprag_study.engine.vibration_drive.settle import settle
    from sprag_study.engine.vibration_drive.simulate import simulate

    cases = np.arange(0, CASES, CASES // _COMPARED)[:_COMPARED]
    # Long enough for every event; few orbits are that quick.
    short = Run(duration=Span(12.0), window=(Span(6.0), Span(12.0)))
    found = set()
    for size in _BATCHES:
        digest = hashlib.sha256()
        for first in range(0, len(cases), size):
            part = cases[first : first + size]
            columns = workload.columns(part)
            batch = settle(columns, SettledRun(at_most=80), cases=len(part)) if settled else None
            values = simulate(columns, short, cases=len(part)).values if batch is None else batch.values
            digest.update(values.tobytes())
        found.add(digest.hexdigest())
    assert len(found) == 1, "batches of other sizes give other bits"
    return found.pop()


def _bits_of_presets() -> dict[str, str]:
    """Hashes of the results of the first cases of every preset, by its name."""
    from sprag_study.service.presets import preset_names, preset_text
    from sprag_study.service.spec.document import load_spec, parse_spec
    from sprag_study.worker import models

    found = {}
    for name in preset_names():
        file, text = preset_text(name)
        study = parse_spec(load_spec(text, file.rpartition(".")[2])).study
        count = min(study.cases, _PRESET_CASES) if study.sweep is None else study.cases  # lines are run whole
        values = models.run_chunk(study, 0, count).values
        found[name] = hashlib.sha256(values.tobytes()).hexdigest()
    return found


def _answer(question: list[Any]) -> Any:
    from sprag_study.engine.vibration_drive.simulate import simulate

    if question[0] == "presets":
        return _bits_of_presets()
    workload = _WORKLOADS[question[1]]
    if question[0] == "bits":
        return _bits(workload, question[2])
    cases = np.arange(question[2])
    columns = workload.columns(cases)
    begin = time.process_time()
    simulate(columns, Run(), cases=len(cases))
    return time.process_time() - begin


class _Process:
    """A process that computes by one code and answers questions."""

    def __init__(self, environment: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.processors", "--child"],
            cwd=ROOT,
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def ask(self, *question: Any) -> Any:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        print(json.dumps(question), file=self.process.stdin, flush=True)
        return json.loads(self.process.stdout.readline())

    def end(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--cases", type=int, default=CASES)
    parser.add_argument("--plain", action="store_true", help="with plain numba, too, which takes minutes to compile")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        for line in sys.stdin:
            print(json.dumps(_answer(json.loads(line))), flush=True)
        return
    print(f"LLVM takes this processor for {llvm.get_host_cpu_name()}")
    processes = {name: _Process(environment) for name, environment in codes(options.plain).items()}
    for workload in _WORKLOADS:
        for settled in (False, True):
            bits = {name: process.ask("bits", workload, settled) for name, process in processes.items()}
            kind = "settled" if settled else "12 periods"
            print(f"{workload}, {kind}: {'the same bits' if len(set(bits.values())) == 1 else f'NOT THE SAME: {bits}'}")
        times: dict[str, float] = {}
        for _ in range(options.repeats):
            for name, process in processes.items():
                if name not in ("SSE", "plain numba"):
                    times[name] = min(times.get(name, np.inf), process.ask("time", workload, options.cases))
        for name, seconds in times.items():
            print(f"  {name:<12}{options.cases / seconds:8.0f} cases/s  {times['chosen'] / seconds:6.3f} of chosen")
    # Without the slowest code: its drives take hours.
    bits = {name: process.ask("presets") for name, process in processes.items() if name != "SSE"}
    for preset, digest in bits["chosen"].items():
        others = [name for name, found in bits.items() if found[preset] != digest]
        print(f"{preset}: {f'NOT THE SAME with {others}' if others else 'the same bits'}")
    for process in processes.values():
        process.end()


if __name__ == "__main__":
    main()
