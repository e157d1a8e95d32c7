from .bounds.brackets import Brackets as Brackets
from .bounds.brackets import bracket_eigenvalues as bracket_eigenvalues
from .certificate import Certificate as Certificate
from .comparison.angles import EigenspaceAngles as EigenspaceAngles
from .comparison.angles import eigenspace_angles as eigenspace_angles
from .comparison.eigenspaces import eigenspace_errors as eigenspace_errors
from .comparison.eigenspaces import separated_groups as separated_groups
from .comparison.spectra import SpectrumComparison as SpectrumComparison
from .comparison.spectra import compare_spectra as compare_spectra
from .comparison.spectra import spectral_hausdorff_distance as spectral_hausdorff_distance
from .laws.laplacian_laws import check_laplacian as check_laplacian
from .laws.operator_laws import check_operator as check_operator
from .laws.report import DEFAULT_PROMISES as DEFAULT_PROMISES
from .laws.report import Law as Law
from .laws.report import OperatorReport as OperatorReport
from .laws.report import SkippedLaw as SkippedLaw
from .maps.functional_map import FunctionalMap as FunctionalMap
from .maps.functional_map import compose_maps as compose_maps
from .maps.functional_map import functional_map as functional_map
from .maps.functional_map import transfer_function as transfer_function
from .maps.point_maps import map_from_points as map_from_points
from .maps.point_maps import point_map as point_map
from .maps.point_maps import refine_map as refine_map
from .signatures.approximate_heat import ApproximateSignature as ApproximateSignature
from .signatures.approximate_heat import (
    approximate_heat_signature as approximate_heat_signature,
)
from .signatures.heat import default_times as default_times
from .signatures.heat import heat_kernel_signature as heat_kernel_signature
from .signatures.heat import reflection_free_signature as reflection_free_signature
from .signatures.heat import (
    scale_invariant_signature as scale_invariant_signature,
)
from .signatures.wave import default_energies as default_energies
from .signatures.wave import wave_kernel_signature as wave_kernel_signature
from .solve import solve_spectrum as solve_spectrum
from .solver.certify import certify as certify
from .spectrum import Spectrum as Spectrum
