"""The walk of the simulated robot: its gait, the kinematics of the legs, and its odometry."""
