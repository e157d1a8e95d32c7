"""Heat and wave kernel signatures."""
