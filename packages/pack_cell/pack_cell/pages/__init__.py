"""What the HTML pages of the cell have in common: frame, style sheet, safe rendering."""
