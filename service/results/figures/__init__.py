"""What is drawn, described once: painters of pictures and of pages draw the same description."""
