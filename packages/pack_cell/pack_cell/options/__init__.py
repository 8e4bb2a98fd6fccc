"""Options on the command line: declared once, read, listed."""
