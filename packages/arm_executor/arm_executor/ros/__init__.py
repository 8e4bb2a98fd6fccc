"""The node, and messages to and from values: the only room of this package that imports ROS."""
