"""Programs that are written: read back, judged, and compared with another one."""
