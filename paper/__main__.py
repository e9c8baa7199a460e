"""``python -m paper`` runs the paper, with the options of ``feeler reproduce``; ``python -m paper
compare A.csv B.csv`` compares two tables of results.
"""

import argparse
import sys
from pathlib import Path

from feeler.cli import main


def compare_files(arguments: list[str]) -> int:
    """Print the rows that differ; 0 where none does, as ``diff`` does."""
    from feeler.errors import FeelerError
    from paper.table import Results, compare

    parser = argparse.ArgumentParser(
        prog="python -m paper compare", description="Compare two tables of results row by row."
    )
    parser.add_argument("first", type=Path, help="results.csv of a run")
    parser.add_argument("second", type=Path, help="results.csv of another run")
    parser.add_argument(
        "--tolerance", type=float, default=1e-6, help="share by which values may differ"
    )
    asked = parser.parse_args(arguments)
    try:
        first, second = (Results.read(path).table for path in (asked.first, asked.second))
    except FeelerError as error:
        parser.error(str(error))
    found = compare(first, second, asked.tolerance)
    if not found.empty:
        print(found.to_string(index=False, float_format="%.6g", na_rep="–"))
    apart = int(found["apart"].sum())
    print(
        f"{len(first)} and {len(second)} rows: {len(found)} differ by more than"
        f" {asked.tolerance:g} or are in one table only; of {apart} the intervals are apart"
    )
    return int(not found.empty)


if __name__ == "__main__":
    if sys.argv[1:2] == ["compare"]:
        sys.exit(compare_files(sys.argv[2:]))
    sys.argv.insert(1, "reproduce")
    main()
