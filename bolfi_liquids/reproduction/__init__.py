"""The paper's figures and what it left open, on simulated truths and another solver's pours."""
