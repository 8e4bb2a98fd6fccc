"""Motion: paths, collision, timing, planning."""
