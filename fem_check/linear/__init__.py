"""Quasi-static solution by finite elements, and its comparison with the closed forms."""
