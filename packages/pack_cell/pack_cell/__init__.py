"""The whole cell: command line, supervisor, recorder, summary, launch files."""
