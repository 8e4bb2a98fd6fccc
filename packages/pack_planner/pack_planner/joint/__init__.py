"""The joint problem of MPack: search, models for solvers."""
