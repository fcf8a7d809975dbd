"""Rows of numbers in text, quickly and strictly."""
