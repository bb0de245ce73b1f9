"""The scenes `ellipse` and `step`: inverse kinematics of an arm, one tick of each package."""
