"""Contours: boundaries, frames along them, curvature and subdivision. Arrays in, arrays out."""
