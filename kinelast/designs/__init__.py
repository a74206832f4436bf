"""Designs: figures of many at once, how they change with what, and which is best."""
