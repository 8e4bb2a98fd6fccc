"""Robot models: published parameters, kinematics in closed form, shapes and URDF."""
