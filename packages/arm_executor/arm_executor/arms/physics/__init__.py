"""The arm in the physics world: its world, driver, gripper, plans and execution."""
