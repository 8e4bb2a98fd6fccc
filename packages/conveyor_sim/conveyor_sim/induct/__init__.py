"""How boxes come onto the belt: arrivals, induct, and the book of who is where."""
