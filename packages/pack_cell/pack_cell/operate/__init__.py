"""Working a running cell: its state in one word and sentence, and the verbs of an operator."""
