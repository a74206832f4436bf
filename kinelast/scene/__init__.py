"""Scene files: tables and keys, and the scenes built from them."""
