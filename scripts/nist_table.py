#!/usr/bin/env python3
"""Makes tests/nist/problems.csv from the files of the NIST StRD for nonlinear regression.

    python scripts/nist_table.py FOLDER_WITH_DAT_FILES

The files are the 27 `*.dat` of https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml. In each, lines
`b1 = start1 start2 certified standard-deviation` follow the model, then the residual sum of squares and
its standard deviation; the observations (response, then predictors) begin at line 61. Numbers are copied as
they are written there. The degrees of freedom are left out: they are observations less parameters, as the
residual standard deviation confirms, but for Rat43 the file says 9 instead of 11. `tests/nist.rs` and `scripts/nist_scipy.py` read the table, and the former compares it
with the files where they are present. Standard library only.
"""

import re
import sys
from pathlib import Path

FIRST_OBSERVATION = 61
HEAD = """\
# NIST StRD, nonlinear regression (https://www.itl.nist.gov/div898/strd/nls/nls_main.shtml); made by
# scripts/nist_table.py. Below each problem its parameters, then its observations.
# problem,name,residual sum of squares,residual standard deviation
# parameter,start 1,start 2,certified value,certified standard deviation
# observation,response,predictors...
"""


def problem(path: Path) -> list[str]:
    """The lines of one problem."""
    lines = path.read_text(encoding="ascii").splitlines()
    head, rows = lines[: FIRST_OBSERVATION - 1], lines[FIRST_OBSERVATION - 1 :]

    def value(label: str) -> str:
        return re.search(rf"{label}:\s*(\S+)", "\n".join(head)).group(1)

    parameters = [line.split("=")[1].split() for line in head if re.match(r"\s*b\d+ =", line)]
    observations = [row.split() for row in rows if row.strip()]
    assert len(observations) == int(value("Number of Observations")), path
    return [
        ",".join(["problem", path.stem, value("Residual Sum of Squares"), value("Residual Standard Deviation")]),
        *(",".join(["parameter", *numbers]) for numbers in parameters),
        *(",".join(["observation", *numbers]) for numbers in observations),
    ]


def main() -> None:
    files = sorted(Path(sys.argv[1]).glob("*.dat"))
    assert len(files) == 27, f"27 problems expected, {len(files)} found"
    lines = [line for path in files for line in problem(path)]
    target = Path(__file__).resolve().parent.parent / "tests" / "nist" / "problems.csv"
    target.write_text(HEAD + "\n".join(lines) + "\n", encoding="ascii")


if __name__ == "__main__":
    main()
