"""STEP, BREP and IGES: the contours of a part on its exact edges, by the CAD kernel in a process of its own."""
