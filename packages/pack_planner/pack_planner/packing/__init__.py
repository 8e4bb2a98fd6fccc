"""Whole streams of boxes packed without belt, arm or ROS: for researchers and the benchmark."""
