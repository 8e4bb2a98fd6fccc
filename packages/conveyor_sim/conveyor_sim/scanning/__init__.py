"""What the scanner sees: measurement, inspection, faults."""
