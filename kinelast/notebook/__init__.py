"""A scene at hand: what a notebook asks of it, by name, and shows inline."""
