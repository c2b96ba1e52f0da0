"""How it is done: the law, its gains, the controller."""
