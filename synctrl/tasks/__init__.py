"""What is asked: spaces, desired motion, couplings, cells."""
