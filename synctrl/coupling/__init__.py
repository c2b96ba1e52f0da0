"""Who is compared with whom: couplings, their weights, and the cells that need both robots and a coupling."""
