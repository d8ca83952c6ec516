"""Results as Parquet: a file per chunk while a study runs, one table when it is done.

A file stands under its name when it is whole, so one that a killed process left half written is never
taken for a result.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tenbaud.files.whole import make_folder, whole_file
from tenbaud.studies.chunk import ChunkResult
from tenbaud.studies.compiled import require
from tenbaud.studies.figures import FlightFigures, OutputFigures
from tenbaud.studies.machine_code import sources_digest
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Study

NONE = OutputFigures()

STUDY_KEY, SOURCES_KEY = b"tenbaud.study", b"tenbaud.sources"


class Results:
    """The folder of a study's results."""

    def __init__(self, study: Study, folder: Path) -> None:
        require("pyarrow")
        self.study = study
        self.folder = folder
        self.table_path = folder / "results.parquet"
        self._chunks = folder / "chunks"
        self._metadata = {STUDY_KEY: study.digest.encode(), SOURCES_KEY: sources_digest().encode()}

    def prepare(self) -> set[int]:
        """Make the folder; return the chunks that are there already, whole and of this study.

        StudyError when the folder holds the results of another study or of other sources.
        """
        make_folder(self._chunks)
        for left in self._chunks.glob(".*.part"):
            left.unlink(missing_ok=True)
        done = set()
        for index in range(self.study.chunks):
            path = self._path(index)
            if path.exists() and self._is_whole(path, index):
                done.add(index)
        return done

    def write(self, result: ChunkResult) -> None:
        import pyarrow as pa

        columns: dict[str, list[Any]] = {"flight": [], "point": [], "seed": []}
        columns |= {name: [] for name in self.study.names}
        for number in self.study.chunk(result.chunk):
            point, seed = self.study.flight(number)
            columns["flight"].append(number)
            columns["point"].append(point)
            columns["seed"].append(seed)
            for name in self.study.names:
                columns[name].append(self.study.points[point][name])
        for field in FlightFigures._fields:
            if field != "outputs":
                columns[field] = [getattr(one, field) for one in result.figures]
        columns |= self._of_outputs(result.figures)
        table = pa.table({name: _column(name, values, self.study) for name, values in columns.items()})
        self._store(table, self._path(result.chunk))

    def _of_outputs(self, figures: list[FlightFigures]) -> dict[str, list[Any]]:
        """Return the columns of the outputs: those of all but the first end in its name."""
        columns = {}
        for place, output in enumerate(self.study.outputs):
            name = f"_{output.name}" if place else ""
            found = [one.outputs[place] if place < len(one.outputs) else NONE for one in figures]
            for field in OutputFigures._fields:
                columns[field + name] = [getattr(one, field) for one in found]
        return columns

    def join(self) -> Any:
        """Write all chunks as one table; return it."""
        import pyarrow as pa

        parts = [_table(self._path(index)) for index in range(self.study.chunks)]
        table = pa.concat_tables(parts)
        self._store(table, self.table_path)
        return table

    def _store(self, table: Any, path: Path) -> None:
        import pyarrow.parquet as pq

        with whole_file(path) as stream:
            pq.write_table(table.replace_schema_metadata(self._metadata), stream)

    def _path(self, index: int) -> Path:
        return self._chunks / f"{index:06d}.parquet"

    def _is_whole(self, path: Path, index: int) -> bool:
        """Return whether a file holds this chunk; one that cannot be read is removed."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        try:
            with path.open("rb") as stream:
                file = pq.read_metadata(stream)
                metadata = file.metadata or {}
                pq.read_table(stream)
        except (pa.ArrowException, OSError):
            path.unlink(missing_ok=True)
            return False
        for key, what in ((STUDY_KEY, "another study"), (SOURCES_KEY, "another version of tenbaud")):
            if metadata.get(key) != self._metadata[key]:
                raise StudyError(
                    f"{self.folder} holds results of {what}; name another folder with --out, or "
                    "remove it"
                )
        return bool(file.num_rows == len(self.study.chunk(index)))


def _column(name: str, values: list[Any], study: Study) -> Any:
    """Return a column whose type is the same in every chunk."""
    import pyarrow as pa

    if name not in study.names:
        return pa.array(values)
    kinds = {type(point[name]) for point in study.points}
    if kinds <= {int, float} and float in kinds:
        return pa.array([float(value) for value in values])
    if len(kinds) > 1:
        return pa.array([str(value) for value in values])
    return pa.array(values)


def _table(path: Path) -> Any:
    import pyarrow.parquet as pq

    # Opened by Python, which takes names that are no text.
    with path.open("rb") as stream:
        return pq.read_table(stream)
