"""Does it pay to steer? Declared in feeler/active/contests.toml."""
