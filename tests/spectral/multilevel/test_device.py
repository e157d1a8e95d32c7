import sys
import types
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from eigenshape.operators.cotangent import cotangent_laplacian
from eigenshape.shapes.spheres import fibonacci_sphere
from eigenshape.spectral.multilevel import device
from eigenshape.spectral.multilevel import start as climbing
from eigenshape.spectral.multilevel.approximate import approximate_spectrum


def stand_in(count):
    """Numpy under the name of CuPy."""
    module = types.ModuleType("cupy")
    module.__dict__.update(
        {name: getattr(np, name) for name in dir(np) if not name.startswith("_")}
    )
    module.asnumpy = np.asarray
    module.cuda = types.SimpleNamespace(runtime=types.SimpleNamespace(getDeviceCount=count))
    return module


@pytest.fixture
def cupy(monkeypatch):
    def install(count):
        monkeypatch.setitem(sys.modules, "cupy", stand_in(count))
        for name in ("cupyx", "cupyx.scipy"):
            monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
        monkeypatch.setitem(sys.modules, "cupyx.scipy.sparse", sp)

    return install


def test_another_pair_of_libraries_gives_the_same_bits(cupy, monkeypatch):
    monkeypatch.setattr(climbing, "COARSEST", 100)
    monkeypatch.setattr(climbing, "COARSEST_PER_PAIR", 1)
    monkeypatch.setattr(
        device, "CPU", replace(device.CPU, rows=device.GPU_ROWS)
    )  # sums in the same order
    cupy(lambda: 1)
    laplacian = cotangent_laplacian(fibonacci_sphere(9000))
    one = approximate_spectrum(laplacian, 9, accuracy=1e-5)
    two = approximate_spectrum(laplacian, 9, accuracy=1e-5, device="gpu")
    assert np.array_equal(one.eigenvalues, two.eigenvalues)
    assert np.array_equal(one.eigenvectors, two.eigenvectors)
    assert device.open_device("gpu").arrays is sys.modules["cupy"]


def test_a_machine_without_a_gpu_is_named(cupy):
    cupy(lambda: 0)
    with pytest.warns(UserWarning, match="CuPy finds no GPU. Install the driver"):
        assert device.open_device("gpu") is device.CPU

    def broken():
        raise RuntimeError("cudaErrorInsufficientDriver")

    cupy(broken)
    with pytest.warns(UserWarning, match=r"no GPU that it can use \(cudaErrorInsufficientDriver\)"):
        assert device.open_device("gpu") is device.CPU
