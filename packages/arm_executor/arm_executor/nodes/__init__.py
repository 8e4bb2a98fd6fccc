"""Parts of the node: what it publishes, and messages to and from values."""
