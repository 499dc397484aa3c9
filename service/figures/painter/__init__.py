"""The painter of described figures: SVG in which text never overlaps, coloured by the variables of the pages."""
