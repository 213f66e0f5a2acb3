"""What happens at an instant of a motion, and the loop from one to the next."""
