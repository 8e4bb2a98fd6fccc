"""Decides which box goes where: packing engine, algorithms, and the node `planner`."""

from pathlib import Path

from pack_planner.machine_code import keep_apart

keep_apart(Path(__file__).parent)
