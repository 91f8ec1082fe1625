"""Libraries of cameras' makers: imported when a camera of theirs is opened, and not before."""

import importlib
from types import ModuleType

from kempelen.core.errors import CameraError


def library(module: str, camera: str, extra: str, system: str) -> ModuleType:
    """An optional library.

    Args:
        module: To import.
        camera: That needs it.
        extra: Of our package, which installs it.
        system: What the system needs besides.

    Raises:
        CameraError: it is not installed, or cannot be loaded; with the line that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError) and error.name == module
        what = "is not installed" if missing else f"cannot be loaded: {error}"
        raise CameraError(
            f"A {camera} needs the Python package {module}, which {what}.",
            hint=f"Install it: pip install 'kempelen[{extra}]'. It needs {system}.",
        ) from error
