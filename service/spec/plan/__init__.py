"""The part of the spec by which a study chooses its own cases: refined curves and maps (`refine`), goals (`goal`)."""
