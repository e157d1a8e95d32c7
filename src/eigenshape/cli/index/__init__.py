"""The verbs of `eigenshape index`, a module each."""
