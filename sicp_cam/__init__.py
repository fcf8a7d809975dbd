"""Correct CAM tool paths to the scanned shape of sagging parts with Subdivision-ICP."""
