"""The answer of a study in a sentence or two and a few numbers, for each kind of study."""
