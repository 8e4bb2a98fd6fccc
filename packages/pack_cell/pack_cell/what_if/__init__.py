"""``cell compare``: kinds of bin, algorithms and settings on one's own boxes; a recommendation."""
