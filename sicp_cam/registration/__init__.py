"""Registration: start, rigid pose, segments, blending. Arrays in, arrays out."""
