"""Scans that other libraries read: E57 and LAS, in a process of their own."""
