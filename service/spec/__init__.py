"""The study spec: its text, its quantities, the report of faults; `document` reads the whole."""
