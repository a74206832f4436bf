"""Vibration of the moving links: steady state, transient, stability, buckling, about the rigid motion."""
