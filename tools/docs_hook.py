"""Pages that are written from the program itself, so that they cannot differ from it."""

import importlib
import subprocess
import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from kempelen.app.config_example import example_toml
from kempelen.core import errors
from kempelen.core.errors import KempelenError

ROOT = Path(__file__).parents[1]
PACKAGES = ("core", "kinematics", "motion", "game", "engines", "robots", "twin", "app")
PROJECT = {"architecture": "ARCHITECTURE.md", "contributing": "CONTRIBUTING.md", "changes": "CHANGELOG.md"}

CONFIGURATION = """# Configuration

No file is needed: the defaults describe the twin. `kempelen config` prints the file below; keep the
lines that you change. It is looked for in `~/.config/kempelen/config.toml`, or named with `--config`.
Options of the command line are stronger than the environment variable `KEMPELEN_DATA_DIR`, which is
stronger than the file. A key that is not listed here is an error.

"""

ERRORS = """# Errors and exit codes

Every error says what happened and where, the number with its unit, the allowed range, and on its own
line what to do next. A script sees the exit code.

| error | exit code | meaning |
|---|---|---|
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages to those of ``docs/``."""
    pages = {
        "reference/commands.md": commands_page(),
        "reference/configuration.md": f"{CONFIGURATION}```toml\n{example_toml()}```\n",
        "reference/errors.md": errors_page(),
    }
    pages |= {f"reference/{name}.md": package_page(name) for name in PACKAGES}
    for name, file in PROJECT.items():
        pages[f"project/{name}.md"] = (ROOT / file).read_text(encoding="utf-8")
    for path, content in pages.items():
        files.append(File.generated(config, path, content=content))
    return files


def commands_page() -> str:
    """What every command and option is for."""
    command = [sys.executable, "-m", "typer", "kempelen.cli.main", "utils", "docs", "--name", "kempelen"]
    told = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT).stdout
    return told.replace("# `kempelen`", "# Commands", 1)


def package_page(name: str) -> str:
    """The public names of every module of a package, from their docstrings."""
    folder = ROOT / "src" / "kempelen" / name
    modules = sorted(file for file in folder.rglob("*.py") if not file.name.startswith("__"))
    package = importlib.import_module(f"kempelen.{name}")
    dotted = [".".join(file.relative_to(ROOT / "src").with_suffix("").parts) for file in modules]
    blocks = [f"# {name.capitalize()}", package.__doc__ or "", *(f"::: {module}" for module in dotted)]
    return "\n\n".join([*blocks, ""])


def errors_page() -> str:
    """The tree of errors, and what a script sees of them."""
    known = [value for value in vars(errors).values() if isinstance(value, type)]
    tree = [error for error in known if issubclass(error, KempelenError)]
    rows = [f"| `{error.__name__}` | {error.exit_code} | {_first_line(error.__doc__)} |" for error in tree]
    return ERRORS + "\n".join([*rows, ""])


def _first_line(text: str | None) -> str:
    return (text or "").partition("\n")[0]
