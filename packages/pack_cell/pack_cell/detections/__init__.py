"""Scans made from what a camera detects (vision_msgs/Detection3DArray)."""
