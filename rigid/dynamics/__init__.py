"""Forces against motion: springs, laws, energy, drive efforts by further routes, forward dynamics."""
