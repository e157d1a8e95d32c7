"""Points on a shape, and how much of it each stands for."""
