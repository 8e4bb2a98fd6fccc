"""``cell render``: pictures and films of a recorded run, drawn in software."""
