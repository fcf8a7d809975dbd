"""Tool paths: transfer of the correction, tool axes, gates. Arrays in, arrays out."""
