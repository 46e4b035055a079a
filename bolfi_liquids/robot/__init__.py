"""Record and pour with the arm."""
