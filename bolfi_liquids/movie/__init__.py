"""Moving pictures of a stir or a pour."""
