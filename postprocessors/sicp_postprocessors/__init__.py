"""Postprocessors: one module per controller, each from a Program to the bytes of its files."""
