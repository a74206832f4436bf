"""One scene from its motion to its folder: computed, weighed, written, and told in a line."""
