"""Results of a scene as figures: numbers with units and errors, such as the largest deflection of each link."""
