"""Figures inside pages: those of studies and cases, motions, shafts, clutch fits."""
