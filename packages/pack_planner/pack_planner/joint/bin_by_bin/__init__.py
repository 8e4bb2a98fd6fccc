"""The exact search of MPack: boxes to bins first, then each group of boxes in its bin."""
