"""Sweeps: many designs of a scene, computed and stored in chunks, on one or several computers."""
