"""Robots that touch: objects that several hands hold, and the forces between them."""
