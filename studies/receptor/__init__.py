"""Which receptor noise makes the published gradient the best."""
