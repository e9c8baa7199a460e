"""Which receptor noise makes the published gradient the best.

Page: docs/receptor_noise.md.
"""
