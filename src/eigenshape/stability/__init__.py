"""How stable a spectrum is: closeness of shapes, one-to-one correspondences, perturbation bounds (thesis ch. 3, 4)."""
