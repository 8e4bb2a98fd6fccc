"""Acts on placements: robot model, motion, physics world, bin journal, action server."""
