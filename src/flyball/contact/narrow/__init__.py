"""Where two shapes touch: nearest points, depths, faces cut by each other; nothing that lasts longer than a pair."""
