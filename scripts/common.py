"""What several of the scripts beside this one need."""

import importlib.util
import os
from pathlib import Path

# The measurements beside the checkout, or wherever they are said to be.
SHARED_DATA = Path(os.environ.get("BRDFIT_SHARED_DATA", Path(__file__).resolve().parents[1] / "../shared/data"))


def nbrdf_tool():
    """The module that comes with the measurements and decodes neural regressions to MERL tables."""
    path = SHARED_DATA / "../tools/nbrdf_to_merl.py"
    spec = importlib.util.spec_from_file_location("nbrdf_to_merl", path)
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return tool


def write_files(folder, files):
    """Writes made-up files, name by name with their text, for the self-test of a script that reads a tree."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def checked_brdfit(parser, path):
    """The whole path of the program, which `parser` complains of unless it can be run."""
    if not path:
        parser.error("--brdfit PATH is needed (or --self-test)")
    whole = str(Path(path).resolve())
    if not os.access(whole, os.X_OK):
        parser.error(f"{whole}: not an executable file")
    return whole
