"""How well location, size and speed can be read, beside their bounds."""
