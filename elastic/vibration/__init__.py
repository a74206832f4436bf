"""Natural frequencies of the mechanism as a structure."""
