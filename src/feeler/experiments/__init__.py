"""Experiments on an antenna: touch, bend, release, hit. Each returns a Dataset."""
