"""Where things are and how they lie: poses, footprints, resting heights, tolerances."""
