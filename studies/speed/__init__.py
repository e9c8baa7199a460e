"""How fast to touch: speed against accuracy against energy. Declared in feeler/tradeoff.toml."""
