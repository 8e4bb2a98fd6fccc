"""The live page: what it shows, from values to a web page (no ROS)."""
