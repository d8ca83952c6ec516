"""The format of a log, by its first bytes, and its reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tenbaud.log.table import LogError, Table, Wanted

Reader = Callable[[str | Path, Wanted | None], Table]
MCAP_MAGIC = b"\x89MCAP0\r\n"
EXPORTED = ("flight.csv", "flight.parquet")
"""The contents of a folder that `tenbaud convert` wrote."""


def read_table(path: str | Path, wanted: Wanted | None = None) -> Table:
    """Return the columns of a log that `wanted` chooses from their names, all of them without it.

    LogError for a file that cannot be read or holds no table.
    """
    path = Path(path)
    if path.is_dir():
        path = next((path / name for name in EXPORTED if (path / name).is_file()), path)
    return _reader(path)(path, wanted)


def _reader(path: Path) -> Callable[[Path, Wanted | None], Table]:
    """Return the reader of a file; the libraries of other formats are imported with their readers."""
    try:
        with path.open("rb") as file:
            head = file.read(8)
    except IsADirectoryError:
        head = MCAP_MAGIC
    except OSError as error:
        raise LogError(f"{path}: cannot be read: {error.strerror}") from error
    if head == MCAP_MAGIC:
        from tenbaud.log.own import read_run as reader
    elif head[:1] == b"{":
        from tenbaud.log.own import read_json as reader
    elif head[:4] == b"PAR1":
        from tenbaud.log.frames import read_parquet as reader
    elif head[:4] == b"TDSm":
        from tenbaud.log.frames import read_tdms as reader
    elif head[:6] == b"\x93NUMPY" or path.suffix == ".npz":
        from tenbaud.log.frames import read_numpy as reader
    elif head[:6] == b"MATLAB" or path.suffix == ".mat":
        from tenbaud.log.matlab import read_matlab as reader
    else:
        from tenbaud.log.text import read_text as reader
    return reader
