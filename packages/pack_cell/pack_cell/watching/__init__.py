"""What the nodes of a running cell say, put together; which cells run on this machine."""
