"""Structure of a mechanism: joints and groups in the order of solution, graphs, mobility and redundancy by rank."""
