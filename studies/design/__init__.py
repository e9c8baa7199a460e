"""Which antenna discriminates best."""
