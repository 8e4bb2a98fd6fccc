"""``cell tune``: weights of a packing algorithm for boxes and bins of one's own."""
