"""Quasi-static finite element solution of a mechanism, and its comparison with the closed forms of `elastic`."""
