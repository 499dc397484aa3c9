"""Width of the vectors of compiled code: that of the processor, not that of LLVM's tuning for its name."""

from typing import Any

import llvmlite.binding as llvm
import numba

#: A feature of processors that do not reduce their clock for 512-bit arithmetic: Ice Lake, Zen 4 and later.
_KEEPS_ITS_CLOCK = "avx512vbmi2"


def use_full_vectors() -> None:
    """Make numba compile for vectors of 512 bits where the processor is faster with them (docs/adr/0009).

    LLVM halves the vectors for processors that it treats as Intel's. The user's settings of processor or features take
    precedence. There is no effect in a process in which numba has already compiled.
    """
    config: Any = numba.config  # numba does not declare its settings
    if config.CPU_NAME is not None or config.CPU_FEATURES is not None or not config.ENABLE_AVX:
        return
    features = llvm.get_host_cpu_features()
    if features.get(_KEEPS_ITS_CLOCK):
        config.CPU_FEATURES = f"{features.flatten()},-prefer-256-bit"
