"""MPack as literal models for CP-SAT and MILP solvers."""
