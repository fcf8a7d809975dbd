"""What all readers of paths share: moves, arcs, findings, the text of programs."""
