"""The arms there are, each behind the same protocol: in physics, and timed without a world."""
