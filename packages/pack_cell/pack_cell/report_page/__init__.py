"""The report of runs as a page: figures, charts, bins in 3D, work orders, comparison; and CSV."""
