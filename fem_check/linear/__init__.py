"""The quasi-static answer by finite elements, and its difference from the closed forms."""
