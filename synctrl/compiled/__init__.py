"""The closed loop as generated C: same models, same law, another engine."""
