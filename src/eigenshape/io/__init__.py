"""Files in and out: the only room that reads or writes meshes on disk."""
