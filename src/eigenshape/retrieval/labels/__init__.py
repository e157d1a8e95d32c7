"""Labels of faces: shapes that have them, and their transfer to shapes that have none."""
