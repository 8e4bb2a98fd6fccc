"""The packing engine: exact single-box search on a piecewise-constant height map."""

from pack_planner.engine.engine import Candidate, Engine, EngineMismatch, Weights, Zone
from pack_planner.engine.height_map import BinModel

__all__ = ['BinModel', 'Candidate', 'Engine', 'EngineMismatch', 'Weights', 'Zone']
