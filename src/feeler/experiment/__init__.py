"""What one does with an antenna: touch, bend, release, hit. Each runs the physics and gives a
Dataset.
"""
