"""Studies that choose their own cases, round by round: what the next round is, without I/O."""
