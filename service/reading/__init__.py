"""What people read and type: numbers, quantities and their units, words and sentences."""
