"""What studies give: curves, maps, sensitivity, motions, and how numbers and names are written."""
