"""Decides which box goes where: packing engine, algorithms, and the node `planner`."""
