"""The truth of the bins: what stands where, durable step by step."""
