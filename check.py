"""Run the checks: format, lint, types, layers, tests. CI runs this same file.

python check.py           all of it but the long tests; under three minutes on two cores
python check.py --all     the long tests, the docs site and the studio in a browser, too
python check.py --fast    without the tests
"""

import subprocess
import sys
import tempfile

CHECKS = {
    "format": ["-m", "ruff", "format", "--check", "."],
    "lint": ["-m", "ruff", "check", "."],
    "types": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command as main; main()"],
}
# Each process takes half of the files in a row, so that tests of one file share what they make.
TESTS = ["-m", "pytest", "-n", "2", "--dist", "worksteal"]
STUDIO = ["-m", "pytest", "studio/tests"]  # in one process: a browser takes both cores
DOCS = ["-m", "sphinx", "-q", "-W", "--keep-going", "docs"]


def main() -> int:
    """Run the checks one after the other and print which failed."""
    options, checks = set(sys.argv[1:]), dict(CHECKS)
    if unknown := options - {"--all", "--fast"}:
        sys.exit(f"check.py takes --all or --fast; it was given {', '.join(sorted(unknown))}.")
    with tempfile.TemporaryDirectory() as site:
        if "--all" in options:
            checks["docs"] = [*DOCS, site]
            checks["studio"] = STUDIO
            checks["all tests"] = TESTS
        elif "--fast" not in options:
            checks["tests"] = [*TESTS, "-m", "not long"]
        failed = []
        for name, command in checks.items():
            print(f"== {name}", flush=True)
            if subprocess.run([sys.executable, *command], check=False).returncode:
                failed.append(name)
    print("== readability, for looking and not for enforcing", flush=True)
    subprocess.run([sys.executable, "tests/house/readability.py"], check=True)
    print("== figures that are older than what they time, for looking", flush=True)
    subprocess.run([sys.executable, "benchmarks/figures.py", "--stale"], check=True)
    print(f"failed: {', '.join(failed)}" if failed else f"passed: {', '.join(checks)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
