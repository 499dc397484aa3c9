"""Results of studies: curves, maps, sensitivity, motions, and the wording of numbers and names."""
