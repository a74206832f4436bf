"""What is asked of a moving linkage: limits, dead points, transmission, reach, inverse kinematics."""
