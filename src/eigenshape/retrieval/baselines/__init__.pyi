from .affinity import affinity_distance as affinity_distance
from .affinity import affinity_eigenvalues as affinity_eigenvalues
from .light_fields import light_field as light_field
from .light_fields import light_field_distance as light_field_distance
from .shape_dna import shape_dna as shape_dna
from .shape_dna import shape_dna_distance as shape_dna_distance
