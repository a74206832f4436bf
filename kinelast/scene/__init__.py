"""Scene files: tables and keys, units, and the scenes built from them."""
