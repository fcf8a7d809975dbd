"""What the readers of robot programs share: poses, moves between them, blocks that are left out."""
