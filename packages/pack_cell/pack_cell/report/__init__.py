"""From what was recorded to the figures of a run."""
