"""The planner in the cell: what it hears, asks, awaits and orders, free of ROS."""
