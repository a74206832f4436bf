"""A scene at hand: questions of a notebook, by name, and inline pictures."""
