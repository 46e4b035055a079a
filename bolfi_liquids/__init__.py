"""Learn a liquid's parameters by stirring it, then pour it without spilling."""
