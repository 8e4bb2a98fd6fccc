"""The belt: where boxes are, how it moves, where it jams."""
