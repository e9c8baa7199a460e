"""Calibration: find the mechanics that fit an animal or a robot, and how far to trust the fit."""
