"""Values: numbers with units, kinds of quantities, figures of a machine and their readings, errors in scene files."""
