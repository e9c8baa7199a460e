"""What sensors around the antenna tell of touches from out of the plane.

Page: docs/space.md.
"""
