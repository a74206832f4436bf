"""Sweeps: any number of designs, computed anywhere in chunks, each stored when complete."""
