"""Results of a scene, as figures with units."""
