"""A planar chain in O(n): articulated-body dynamics with MuJoCo's soft contact, eight scenes at a
time.
"""
