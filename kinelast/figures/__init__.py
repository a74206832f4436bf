"""What was found out about a scene, as figures with units."""
