#!/usr/bin/env python3
"""Writes tests/reference/*.csv: values and derivatives of every part and model, with mpmath to 50 digits and more.

    python scripts/reference_values.py                  all files, on all cores; a quarter of an hour on two
    python scripts/reference_values.py --only NAME      files whose name contains NAME
    python scripts/reference_values.py --self-test      a few files again, compared with those in the tree

The formulas are those in the heads of the source files (docs/use/models.md), written anew for exact numbers: from the
definition where the program has a rearranged form, closed forms where it has a quadrature, and the other way round.
tests/reference.rs reads the files, and docs/trust/numerics.md says what it finds.

A row holds the type that it is for (f64 or f32); the arguments (the components of wi and wo as that type holds them, or
mu = wi.h) and the parameters, both exactly; `log_factor`, the |ln| of the value's exponential or power factors; `value`; the
derivative `d_NAME` with respect to each parameter; and `naive_loses`: how many decimal digits of the type the form of the
textbooks loses, evaluated in numpy in that type (empty where no text has one, or the value is beyond the type).

mpmath, numpy and scipy come from scripts/requirements.txt.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
from pathlib import Path

from reference import distributions, fresnel, models, shadowing
from reference.table import Table

FOLDER = Path(__file__).resolve().parents[1] / "tests" / "reference"
SELF_TEST = ("distribution-ggx", "shadowing-smith-beckmann", "fresnel-dielectric", "model-ashikhmin-shirley")


def tables() -> list[Table]:
    return [table for module in (distributions, shadowing, fresnel, models) for table in module.tables()]


def write(name: str) -> str:
    """Writes one file. By name: workers of a pool are not handed functions."""
    (table,) = [table for table in tables() if table.name == name]
    table.write(FOLDER)
    return name


def differences(table: Table) -> list[str]:
    """Where the file in the tree is not what is computed now. The naive form's loss depends on numpy's last digit."""
    found = (FOLDER / f"{table.name}.csv").read_text(encoding="ascii").splitlines()
    made = table.text().splitlines()
    rows = [(a, b) for a, b in zip(found, made) if a.rsplit(",", 1)[0] != b.rsplit(",", 1)[0]]
    lengths = [] if len(found) == len(made) else [f"{table.name}: {len(found)} lines, not {len(made)}"]
    return lengths + [f"{table.name}: {a} is now {b}" for a, b in rows]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", metavar="NAME")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        wrong = [line for table in tables() if table.name in SELF_TEST for line in differences(table)]
        print("\n".join(wrong) or f"same values: {', '.join(SELF_TEST)}")
        return bool(wrong)
    FOLDER.mkdir(exist_ok=True)
    names = [table.name for table in tables() if options.only in table.name]
    with multiprocessing.Pool(os.cpu_count()) as pool:
        for name in pool.imap_unordered(write, names):
            print(name, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
