"""The durable ledger of the belt: every transition of every box, and its statistics."""
