"""``cell journal``: the books of a run, to read, check and export."""
