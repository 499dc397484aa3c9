"""See docs/ and README.md."""
