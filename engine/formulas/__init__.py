"""The language of formulas, of no model."""
