"""Faults from outside, made on purpose: against a running cell, and what its books say after."""
