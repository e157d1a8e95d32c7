"""What a shape is: meshes, their topology, repairs, samples of them, and made-up ones."""
