"""How well: metrics, the Lyapunov proof, certificates."""
