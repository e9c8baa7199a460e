"""Does it pay to steer? Declared in feeler/active/contests.toml.

Page: docs/guide/active.md.
"""
