"""Readers: one module per file format, each from bytes to the neutral model."""
