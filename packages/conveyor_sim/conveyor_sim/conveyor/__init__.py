"""The conveyor: what it is told, what it moves, what it says."""
