"""What was said in a cell, kept: the file of a run, the last seconds before a fault."""
