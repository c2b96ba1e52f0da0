"""Let me see: figures, animations, pages."""
