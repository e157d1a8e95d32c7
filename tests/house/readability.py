"""Counts that hint at how easy the code is to read. They are for looking, not for enforcing."""

import ast
import io
import re
import tokenize
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "src" / "eigenshape", ROOT / "certeig" / "src" / "certeig"
NO_CODE = (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
# Of an f-string, from Python 3.12 on
STRING_START, STRING_END = (getattr(tokenize, f"FSTRING_{end}", None) for end in ("START", "END"))


def source_files() -> list[Path]:
    """Return the modules of both packages."""
    return sorted(path for source in SOURCES for path in source.rglob("*.py"))


def print_counts() -> None:
    """Print tokens a line, comments, private functions with one caller, and the largest folder."""
    texts = {path: path.read_text() for path in source_files()}
    n_tokens = n_lines = n_comments = 0
    for text in texts.values():
        tokens = code_tokens(text)
        n_tokens += len(tokens)
        n_lines += len({token.start[0] for token in tokens})
        n_comments += comments_in_functions(text)
    private = callers_of_private_functions(texts)
    once = sum(count == 1 for count in private.values())
    folder, n_modules = Counter(
        path.parent for path in texts if path.name != "__init__.py"
    ).most_common(1)[0]
    print(f"tokens a code line: {n_tokens / n_lines:.1f}")
    print(f"comments inside functions, per 1,000 code lines: {1000 * n_comments / n_lines:.0f}")
    print(f"private functions with one caller: {once / max(len(private), 1):.0%}")
    print(f"modules in the largest folder, {folder.relative_to(ROOT)}: {n_modules}")


def code_tokens(text: str, *, with_imports: bool = True) -> list[tokenize.TokenInfo]:
    """Return the tokens of code, without those of docstrings and, on request, of imports."""
    left_out: set[int] = set()
    documented = ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, documented) and ast.get_docstring(node, clean=False):
            left_out |= lines_of(node.body[0])
        elif isinstance(node, ast.Import | ast.ImportFrom) and not with_imports:
            left_out |= lines_of(node)
    found, depth = [], 0
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        # An f-string is one token, as in Python 3.11; later ones also tell what is inside.
        depth -= token.type == STRING_END
        is_code = token.string and token.type not in (*NO_CODE, STRING_END)
        if is_code and not depth and token.start[0] not in left_out:
            found.append(token)
        depth += token.type == STRING_START
    return found


def lines_of(node: ast.stmt) -> set[int]:
    """Return the numbers of the lines that a statement stands on."""
    return set(range(node.lineno, (node.end_lineno or node.lineno) + 1))


def comments_in_functions(text: str) -> int:
    """Return the number of comments inside functions."""
    inside: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            inside |= lines_of(node)
    found = tokenize.generate_tokens(io.StringIO(text).readline)
    return sum(token.type == tokenize.COMMENT and token.start[0] in inside for token in found)


def callers_of_private_functions(texts: dict[Path, str]) -> dict[tuple[Path, str], int]:
    """Return how often each private function of a module is named in its module beside its definition."""
    callers = {}
    for path, text in texts.items():
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("_"):
                callers[path, node.name] = len(re.findall(rf"\b{node.name}\b", text)) - 1
    return callers


def uncommented_constants(path: Path) -> list[str]:
    """Return numeric constants of a module that no comment explains, on their line or above."""
    text = path.read_text()
    lines = text.splitlines()
    missing = []
    for node in ast.parse(text).body:
        if isinstance(node, ast.Assign):
            targets, value = node.targets, node.value
        elif isinstance(node, ast.AnnAssign) and node.value:
            targets, value = [node.target], node.value
        else:
            continue
        if not is_number(value) or not isinstance(targets[0], ast.Name):
            continue
        # A comment may stand for a block of constants under it.
        above = node.lineno - 2
        while (
            above >= 0
            and re.match(r"[A-Z_][A-Z0-9_]*\b.*=", lines[above])
            and "#" not in lines[above]
        ):
            above -= 1
        on_line = (
            "#" in lines[node.lineno - 1] or "#" in lines[(node.end_lineno or node.lineno) - 1]
        )
        if not on_line and not lines[max(above, 0)].startswith("#"):
            missing.append(f"{path.relative_to(ROOT)}:{node.lineno} {targets[0].id}")
    return missing


def is_number(node: ast.expr) -> bool:
    """Return whether an expression is made of numbers alone, a tuple of numbers included."""
    parts = [part for part in ast.walk(node) if isinstance(part, ast.expr)]
    numbers = [part for part in parts if isinstance(part, ast.Constant)]
    allowed = ast.Constant | ast.UnaryOp | ast.BinOp | ast.Tuple | ast.List
    return bool(numbers) and all(
        isinstance(part, allowed)
        and (not isinstance(part, ast.Constant) or type(part.value) in (int, float))
        for part in parts
    )


if __name__ == "__main__":
    print_counts()
