"""Run every check there is: format, lint, types, layers, tests. CI runs this same file.

python check.py           all of it
python check.py --fast    without the tests
"""

import subprocess
import sys

CHECKS = {
    "format": ["-m", "ruff", "format", "--check", "."],
    "lint": ["-m", "ruff", "check", "."],
    "types": ["-m", "mypy"],
    "layers": ["-c", "from importlinter.cli import lint_imports_command as main; main()"],
    "tests": ["-m", "pytest", "-n", "2"],
}


def main() -> int:
    """Run the checks one after the other and say which failed."""
    chosen = {name: command for name, command in CHECKS.items() if name != "tests" or "--fast" not in sys.argv[1:]}
    failed = []
    for name, command in chosen.items():
        print(f"== {name}", flush=True)
        if subprocess.run([sys.executable, *command], check=False).returncode:
            failed.append(name)
    print(f"failed: {', '.join(failed)}" if failed else f"passed: {', '.join(chosen)}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
