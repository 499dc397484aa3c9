"""Studies: their rows, digests, lists and removal."""
