"""The form of a new study: its fields, its check, and the spec that it writes."""
