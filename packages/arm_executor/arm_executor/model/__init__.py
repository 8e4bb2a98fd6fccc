"""What an arm and its cell are: the protocol of an arm, the layout, robots and their kinematics."""
