"""``cell boxes``: what a box list means to the cell, before anything runs."""
