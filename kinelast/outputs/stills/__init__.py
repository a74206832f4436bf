"""Stills for papers: curves, maps and the mechanism as vector pictures, by matplotlib, on request."""
