"""One decision: which box, which bin, where; and when a bin is closed."""
