"""Keep an index of shapes: add meshes, list and remove shapes, check, compact, export and merge.

Each verb of `eigenshape index` is a module here.
"""
