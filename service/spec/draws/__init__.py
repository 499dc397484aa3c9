"""What is random in a spec: distributions, points of the unit cube, tolerances."""
