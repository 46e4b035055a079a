"""Choose the pour that spills least in expectation."""
