"""The walk of bodies that hold angles: footsteps by the capture point, inverse kinematics, torques ahead."""
