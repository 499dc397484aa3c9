"""The laboratory: a machine whose numbers change while its motion is redrawn."""
