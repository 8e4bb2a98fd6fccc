"""Parts of the node: what it asks the arm, and what it says of itself."""
