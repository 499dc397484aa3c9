"""All rows of a study: as frames, as grids, as files."""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, overload

from sprag_study.service.client.asynchronous.part import AsyncStudyPart
from sprag_study.service.client.frames import beside, cases_in, grid_of, polars_of, table_of
from sprag_study.service.client.queries import form_of, query_of
from sprag_study.service.client.sketch import Picture
from sprag_study.service.client.statements import CASES, read_only, selected
from sprag_study.service.client.wire import case_path, whole_file
from sprag_study.worker.codes import ENDING_CODES, PENDING

if TYPE_CHECKING:
    from os import PathLike

    import pandas as pd
    import polars as pl
    import xarray as xr

    from sprag_study.service.answers.results import Case, CaseDetail, RegimeRow
    from sprag_study.service.client.queries import Held, Value
    from sprag_study.service.client.wire import Query
    from sprag_study.service.formats import Decimal, Header


class AsyncStudyTables(AsyncStudyPart):
    """Those methods of a study that give all of its rows."""

    async def cases(
        self,
        *,
        ending: str | None = None,
        regime: str | None = None,
        flag: str | None = None,
        where: str | Sequence[str] = (),
        at: Held | None = None,
        sort: str | None = None,
    ) -> AsyncIterator[Case]:
        """Finished cases, in order of their numbers, or those that are asked for.

        Parameters
        ----------
        ending, regime, flag : str, optional
            The only ending, and so on.
        where : str or sequence of str
            Ranges such as "shaft.load <= 2 N*m", all of which must hold.
        at : mapping, optional
            Paths of axes and their only values.
        sort : str, optional
            A parameter, a result, "case", "ending", "flags" or "regime"; "-" before it: from the largest down.
        """
        asked = {"ending": ending, "regime": regime, "flag": flag, "where": where, "at": at, "sort": sort}
        async for case in self._client.items(f"{self._path}/cases", "cases", query_of(asked)):
            yield cast("Case", case)

    async def case(self, case: int) -> CaseDetail:
        """One case: parameters, ending, flags, results; "pending" while it has not been run."""
        return cast("CaseDetail", await self._of_case(case))

    async def regimes(self, case: int) -> list[RegimeRow]:
        """The regimes to which the starts of a case come, the most frequent one first; [] of a case with one start.

        Their results have the share of the starts and its interval, and "regime.start", a start that comes to it.
        """
        return cast("list[RegimeRow]", (await self._of_case(case))["regimes"])

    async def table(self, units: str | None = None) -> pd.DataFrame:
        """All rows with all results as a pandas table, NaN for missing values; ``units`` such as "rpm, mm", or "typed".

        ``attrs["units"]`` has the unit of each column, by default SI, ``attrs["endings"]`` the number of cases of each
        ending, ``attrs["warnings"]`` the warnings about the spec.
        """
        detail = await self._get("")
        table = table_of(await self.download("parquet", units))
        await self._client.require_cases(self._path, detail["progress"]["done"], table["case"].nunique())
        table.attrs["warnings"] = detail["warnings"]
        return table

    async def side_by_side(self, cases: Sequence[int]) -> pd.DataFrame:
        """Cases beside each other: a row for each parameter and result, a column for each case, in the given order.

        SI; the column ``unit`` has the units. RefusedError for a number that is not that of a case.
        """
        return beside([await self.case(case) for case in cases])

    async def polars(self, units: str | None = None) -> pl.DataFrame:
        """All rows with all results as a polars table, null for missing values; ``units`` as for `table`."""
        return polars_of(await self._parquet(units))

    @overload
    async def sql(
        self, statement: str, *, units: str | None = None, polars: Literal[False] = False
    ) -> pd.DataFrame: ...

    @overload
    async def sql(self, statement: str, *, units: str | None = None, polars: Literal[True]) -> pl.DataFrame: ...

    async def sql(
        self, statement: str, *, units: str | None = None, polars: bool = False
    ) -> pd.DataFrame | pl.DataFrame:
        """What a SELECT of DuckDB gives of the table ``cases``, which has the rows and columns of `table`.

        Names with points stand in double quotes: ``select "shaft.load", max("efficiency") from cases group by all``.
        The statement is executed in this process and only reads; it reaches no files and no network.

        Parameters
        ----------
        statement : str
        units : str, optional
            As for `table`.
        polars : bool
            A polars table, instead of a pandas table whose ``attrs["units"]`` has the unit of each column that keeps
            its name.

        Raises
        ------
        StatementError
            For a statement that does not only read, that DuckDB refuses, or whose columns a table cannot have.
        """
        read_only(statement)  # before any row is asked for
        return selected(statement, {CASES: await self._parquet(units)}, polars)

    async def _parquet(self, units: str | None) -> bytes:
        """All rows as the bytes of a Parquet file, in ``units``; UnreachableError where cases are missing."""
        least = await self._client.ended_cases(self._path)
        parquet = await self.download("parquet", units)
        await self._client.require_cases(self._path, least, cases_in(parquet))
        return parquet

    async def grid(self) -> xr.Dataset:
        """All rows as an xarray grid whose dimensions are the axes, with units as attributes."""
        least = await self._client.ended_cases(self._path)
        grid = grid_of(await self.download("netcdf"))
        await self._client.require_cases(self._path, least, int((grid["ending"] != ENDING_CODES[PENDING]).sum()))
        return grid

    async def download(
        self,
        form: str,
        units: str | None = None,
        header: Header | None = None,
        language: str | None = None,
        point: Value | None = None,
        decimal: Decimal | None = None,
    ) -> bytes:
        """All rows in a format of `sprag_study.service.exports`, or the report as "html" or "pdf".

        ``header`` of CSV: "names", with units that are not SI, or "units", with every unit. ``decimal`` of CSV:
        "point", or "comma" for spreadsheets of many countries, with semicolons between columns and a byte order mark.
        ``language`` of a report: a code such as "uk"; English without it. ``point`` of a report: its working point,
        such as "0.3 N*m".
        """
        asked = {"units": units, "header": header, "language": language, "point": point, "decimal": decimal}
        async with self._pieces(form, query_of(asked)) as pieces:
            return b"".join([piece async for piece in pieces])

    async def export(
        self,
        file: str | PathLike[str],
        form: str | None = None,
        *,
        units: str | None = None,
        header: Header | None = None,
        language: str | None = None,
        point: Value | None = None,
        decimal: Decimal | None = None,
    ) -> Path:
        """Write all rows, or a report, to a file; its ending determines the format unless ``form`` is given.

        ``header``, ``language``, ``point`` and ``decimal`` as for `download`. A file that is there already
        stays until all of the new one has arrived.
        """
        path = Path(file)
        # A refusal is raised before anything is written.
        asked = {"units": units, "header": header, "language": language, "point": point, "decimal": decimal}
        async with self._pieces(form or form_of(path), query_of(asked)) as pieces:
            await _written(pieces, path)
        return path

    @asynccontextmanager
    async def _pieces(self, form: str, query: Query) -> AsyncIterator[AsyncIterator[bytes]]:
        if form in ("html", "pdf"):
            opened = self._client.pieces(f"{self._path}/report", [*query, ("format", form)])
        else:
            opened = self._client.rows(self._path, form, query)
        async with opened as pieces:
            yield pieces

    async def plot(
        self,
        x: str | None = None,
        y: str | Sequence[str] = (),
        *,
        by: str | Sequence[str] = (),
        at: Held | None = None,
        units: str | None = None,
        language: str | None = None,
        view: str = "curves",
        case: int | None = None,
        file: str | PathLike[str] | None = None,
        **settings: Any,
    ) -> Picture:
        """Curves, or what else has a picture, as one that notebooks show, and as a file.

        Parameters
        ----------
        x, y, by, at : optional
            As for `curves`, or as the ``view`` has them.
        units : str, optional
            Such as "rpm, mm", or "typed"; by default SI. Views of a case are in SI.
        language : str, optional
            A code such as "uk"; English without it.
        view : str
            Name of the view as in its address: "map", "front", "ribbon", of a case "branch" and so on.
        case : int, optional
            Number of the case, for a view of a case.
        file : str or path, optional
            File to write: .svg, .png or .pdf.
        settings
            Further settings of the view, by their names in its address: ``z="efficiency"``, ``along="shaft.load"``.
        """
        form = "svg" if file is None else Path(file).suffix[1:].lower()
        asked = {"x": x, "y": y, "by": by, "at": at, "units": units, "language": language, **settings}
        content = await self._client.read(self._address(view, case), query_of({**asked, "format": form}))
        picture = Picture(content, form)
        if file is not None:
            picture.save(file)
        return picture

    async def picture(
        self, file: str | PathLike[str], x: str | None = None, y: str | Sequence[str] = (), **settings: Any
    ) -> Path:
        """Write what `plot` gives to a file, whose path is returned."""
        await self.plot(x, y, file=file, **settings)
        return Path(file)

    def _address(self, view: str, case: int | None) -> str:
        return f"{self._path}/{view}" if case is None else case_path(self.id, case, f"/{view}")


async def _written(pieces: AsyncIterator[bytes], path: Path) -> None:
    with whole_file(path) as out:
        async for piece in pieces:
            out.write(piece)
