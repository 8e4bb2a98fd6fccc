"""Running a cell: the nodes as processes, their ROS domain, what is shown meanwhile."""
