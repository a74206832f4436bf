"""Scene files: tables and keys, units, what they describe."""
