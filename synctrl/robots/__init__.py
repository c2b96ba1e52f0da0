"""Who moves: descriptions, rigid-body algorithms, parameters, friction."""
