"""The report of a scene as one page."""
