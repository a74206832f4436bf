"""Natural frequencies by finite elements."""
