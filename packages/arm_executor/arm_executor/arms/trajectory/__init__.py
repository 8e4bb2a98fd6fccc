"""The arm that moves a robot with a driver: plans of its own, executed by a controller."""
