"""Check the shapes of arrays at run time, as the signatures of certeig give them."""

import jaxtyping

# certeig must not be loaded yet.
jaxtyping.install_import_hook("certeig", "checked_types.checked")
