"""What all readers of scans and meshes share: checks, merged vertices, polygons, units."""
