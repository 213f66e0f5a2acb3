"""Few rows with everything between them known: which hold, which slide, which let go."""
