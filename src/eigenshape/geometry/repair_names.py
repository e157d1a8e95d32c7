"""The names of repairs. The command line reads them for its help, so this module is light."""

# Of meshes of any dimension and of surfaces, in the order in which messages and help list them.
MESH_REPAIRS = (
    "auto",
    "weld",
    "weld_seams",
    "collapse_needles",
    "drop_degenerate",
    "drop_duplicate_faces",
    "drop_unreferenced",
    "orient",
    "largest_component",
    "fill_holes",
)
SURFACE_REPAIRS = ("orient", "largest_component", "fill_holes")  # of surfaces only
CLOUD_REPAIRS = ("auto", "drop_duplicate_points")
