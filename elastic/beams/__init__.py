"""One beam: its section, its elastic line, its fields as polynomials."""
