"""Run simulations in executors and keep them in a bank."""
