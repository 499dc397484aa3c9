"""The machine of a study: drive, clutches, shaft."""
