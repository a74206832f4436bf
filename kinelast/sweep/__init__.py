"""The sweep of a scene: any number of designs, computed anywhere in chunks, each kept as soon as it is there."""
