"""The few scalar constraint rows that joints are made of."""
