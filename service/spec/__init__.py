"""The study spec: its text, quantities and report of problems; `document` reads the whole."""
