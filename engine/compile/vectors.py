"""How wide the vectors of compiled code are: as wide as the processor's, not as LLVM's tuning for a name has it."""

from typing import Any

import llvmlite.binding as llvm
import numba

#: A feature of processors that keep their clock under 512-bit arithmetic: Ice Lake, Zen 4 and later.
_KEEPS_ITS_CLOCK = "avx512vbmi2"


def use_full_vectors() -> None:
    """Have numba compile for vectors of 512 bits where the processor computes faster with them (docs/adr/0009).

    LLVM halves the vectors of processors that it takes for one of Intel's. What the user has said of processor or
    features stands. Nothing changes for a process in which numba has compiled before.
    """
    config: Any = numba.config  # numba does not declare its settings
    if config.CPU_NAME is not None or config.CPU_FEATURES is not None or not config.ENABLE_AVX:
        return
    features = llvm.get_host_cpu_features()
    if features.get(_KEEPS_ITS_CLOCK):
        config.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"
