"""What of the node is not its wiring; the only place besides `node.py` that knows ROS."""
