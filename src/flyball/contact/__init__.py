"""Where shapes touch: geometry only. Shapes in arrays and the poses of what carries them go in, contacts come out."""
