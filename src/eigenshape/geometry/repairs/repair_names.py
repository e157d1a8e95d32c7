"""The names of repairs. The command line reads them for its help, so this module is light."""

from collections.abc import Sequence

from certeig.kit.errors import InvalidParameterError

SURFACE_REPAIRS = ("orient", "largest_component", "fill_holes", "cut_one_sided")  # of surfaces only
# Of meshes of any dimension and of surfaces, in the order in which messages and help list them.
MESH_REPAIRS = (
    "auto",
    "drop_missing",
    "weld",
    "weld_seams",
    "collapse_needles",
    "drop_degenerate",
    "drop_duplicate_faces",
    "drop_unreferenced",
    *SURFACE_REPAIRS,
)
CLOUD_REPAIRS = ("auto", "drop_missing", "drop_duplicate_points")
KNOWN_REPAIRS = tuple(dict.fromkeys((*MESH_REPAIRS, *CLOUD_REPAIRS)))  # of any shape


def require_repairs(
    names: Sequence[str], known: Sequence[str] = MESH_REPAIRS, title: str = "Repairs"
) -> tuple[str, ...]:
    """Return names of repairs; raise an error if one is not among the known ones."""
    for number, name in enumerate(names):
        if name not in known:
            raise InvalidParameterError(
                f"{title} must be among {', '.join(known)}; name {number} is {name!r}."
            )
    return tuple(names)
