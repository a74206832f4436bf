"""What the fields mean for a design: strength, buckling, output error, validity of the theory."""
