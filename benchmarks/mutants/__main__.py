"""``python -m benchmarks.mutants``."""

from benchmarks.mutants import main

main()
