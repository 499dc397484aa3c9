"""The sheet of a study: its machine drawn, its answer with charts, what one can ask of it, its variants."""
