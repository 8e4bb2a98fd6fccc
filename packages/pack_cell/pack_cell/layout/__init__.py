"""The layout of a cell on the command line: table, verdict and picture."""
