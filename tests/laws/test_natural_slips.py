"""What people hand over by mistake is answered rightly, or refused by its type: in every public function."""

import json
import re
import subprocess
import sys
from operator import attrgetter
from pathlib import Path

import pytest
from laws.natural_slips import public_callables

import eigenshape as es
from certeig.kit.arguments import CONVERSIONS, MAKERS, READERS

TESTS = Path(__file__).resolve().parents[1]
TORCH_NAMES = (Path(es.__file__).parent / "torch" / "__init__.pyi").read_text()


def test_every_public_function_answers_or_names_what_it_was_given(in_turn):
    # In a process of its own: the type checks of these tests would speak before ours.
    names = in_turn(sorted({name for name, _, _ in public_callables()}))
    done = subprocess.run(
        [sys.executable, "-m", "laws.natural_slips", *names],
        cwd=TESTS,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["functions"] > 180
    assert not found["complaints"], "\n".join(
        f"{where}: {what}" for where, what in found["complaints"]
    )


@pytest.mark.parametrize("call", [*MAKERS.values(), *READERS.values(), *CONVERSIONS.values()])
def test_what_messages_tell_to_call_is_there(call):
    # Each name before a bracket, methods of a class too; what is not ours is from the standard library or scipy.
    names = re.findall(r"[A-Za-z_][A-Za-z_.]*(?=\()", call) or [call] * call.isidentifier()
    ours = [
        name
        for name in names
        if name not in ("Path", "read_bytes", "csr_array", "numpy.random.default_rng")
    ]
    for name in ours:
        if name.startswith("eigenshape.torch."):  # torch need not be installed
            assert f" as {name.rpartition('.')[2]}\n" in TORCH_NAMES
            continue
        assert attrgetter(name.removeprefix("es.").lstrip("."))(es) is not None
