"""Gaussian process: kernel, conditioning, hyperparameters."""
