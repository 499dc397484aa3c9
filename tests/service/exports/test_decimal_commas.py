"""CSV with decimal commas: of every file and table, for the interface, the client and the pages; read back as it is."""

from __future__ import annotations

import csv
import html
import io
import re
from pathlib import Path

import pandas as pd
import pytest
from anyio.from_thread import BlockingPortal

import sprag_study as sprag
from sprag_study.service.client import Client, RefusedError
from sprag_study.service.exports.components import components_csv
from sprag_study.service.exports.decimal_commas import DecimalCommas, with_commas
from sprag_study.service.exports.text import table_csv
from sprag_study.service.spec.components import Component
from tests.service.conftest import API, PortalTransport, Service
from tests.sprag_study.test_library import SPEC

PLAIN = b'case,load,flags\n0,0.25,"a;b"\n1,-1.5e-07,"say ""1.5"", 1.5\nand 2.5"\n2,3,1.2.3\n'
COMMAS = b'\xef\xbb\xbfcase;load;flags\n0;0,25;"a;b"\n1;-1,5e-07;"say ""1.5"", 1.5\nand 2.5"\n2;3;1.2.3\n'


@pytest.mark.parametrize("size", [1, 7, 20, 1000])
def test_pieces_may_end_anywhere(size: int) -> None:
    pieces = [PLAIN[at : at + size] for at in range(0, len(PLAIN), size)]
    assert b"".join(with_commas(pieces)) == COMMAS
    assert b"".join(with_commas([])) == b""


def test_lines_do_not_wait_for_the_last_piece() -> None:
    commas = DecimalCommas()
    assert commas.feed(b"a,b\n1.5,") == b"\xef\xbb\xbfa;b\n"
    assert commas.feed(b"2\n") == b"1,5;2\n"
    assert commas.feed(b"3", last=True) == b"3\n"


def test_texts_that_look_like_numbers_are_left_as_they_are() -> None:
    table = table_csv(["name", "load"], [["1.5", "clutch 2.5", "2"], [0.5, 1.5, -2.5e-07]])
    assert b"".join(with_commas([table])) == (b'\xef\xbb\xbfname;load\n"1.5";0,5\nclutch 2.5;1,5\n2;-2,5e-07\n')
    assert list(csv.reader(io.StringIO(table.decode()))) == [
        ["name", "load"], ["1.5", "0.5"], ["clutch 2.5", "1.5"], ["2", "-2.5e-07"],
    ]  # fmt: skip
    own = components_csv([Component("spring", "1.5", "2.5", {"spring_rate": "0.25", "damping": "0.5 N*m*s/rad"})])
    name, note, *rest = b"".join(with_commas([own])).decode("utf-8-sig").splitlines()[1].split(";")[1:]
    assert (name, note) == ('"1.5"', '"2.5"')
    assert "0,25" in rest


def test_a_study_run_here_has_them(tmp_path: Path) -> None:
    with sprag.run(SPEC, processes=0) as study:
        content = study.export(tmp_path / "here.csv", decimal="comma").read_bytes()
        assert content == b"".join(with_commas([study.download("csv")]))
        table = study.table()
        with pytest.raises(RefusedError, match="decimal"):
            study.download("xlsx", decimal="comma")
        with pytest.raises(RefusedError, match="decimal"):
            study.download("csv", decimal="colon")  # type: ignore[arg-type]
    read = pd.read_csv(io.BytesIO(content), sep=";", decimal=",", encoding="utf-8-sig")
    assert list(read.columns) == list(table.columns)
    assert read["shaft.speed.mean"].tolist() == table["shaft.speed.mean"].tolist()


def test_every_answer_in_csv_has_them(service: Service, portal: BlockingPortal) -> None:
    study = service.submit()
    service.fill(study)
    get = service.http.get
    paths = f"/studies/{study}/results", f"/studies/{study}/curves", "/components", "/audit"
    for path in paths:
        plain = get(API + path, params={"format": "csv"})
        commas = get(API + path, params={"format": "csv", "decimal": "comma"})
        assert (plain.status_code, commas.status_code) == (200, 200), (path, plain.text, commas.text)
        assert commas.content == b"".join(with_commas([plain.content])), path
        assert commas.headers["content-type"] == plain.headers["content-type"]
        refused = get(API + path, params={"format": "json", "decimal": "comma"})
        codes = {error["code"] for error in refused.json().get("errors", [])}
        assert refused.status_code == 422, path
        assert codes & {"not-used", "invalid-choice"}, path
        unknown = get(API + path, params={"format": "csv", "decimal": "x"})
        assert (unknown.status_code, unknown.json()["errors"][0]["code"]) == (422, "invalid-choice"), path
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        content = client.study(study).download("csv", decimal="comma")
    assert content == get(API + paths[0], params={"format": "csv", "decimal": "comma"}).content


def test_a_part_of_the_file_is_all_of_it(service: Service) -> None:
    """A range is one of other bytes."""
    study = service.submit()
    service.fill(study)
    address, query = f"{API}/studies/{study}/results", {"format": "csv", "decimal": "comma"}
    part = service.http.get(address, params=query, headers={"Range": "bytes=0-9"})
    whole = service.http.get(address, params=query)
    assert (part.status_code, part.content) == (200, whole.content)
    assert "accept-ranges" not in whole.headers
    head = service.http.head(address, params=query)
    assert (head.status_code, head.content) == (200, b"")


def test_the_pages_offer_such_files(service: Service) -> None:
    study = service.submit()
    service.fill(study)
    for page in (f"/studies/{study}", f"/studies/{study}/rows", "/parts"):
        links = re.findall(r'href="([^"]*decimal=comma[^"]*)"', service.http.get(page).text)
        assert links, page
        for link in links:
            content = service.http.get(html.unescape(link)).content
            assert content.startswith(b"\xef\xbb\xbf"), link


def test_what_is_written_is_read_back_as_points() -> None:
    """A spec takes the columns of its parameters, with semicolons, decimal commas and the byte order mark."""
    paths = ["shaft.load", "excitation.frequency"]
    cases = {paths[0]: [0.0, 0.125], paths[1]: [20.5, 21.0]}
    with sprag.run(SPEC, cases=cases, processes=0) as study:
        rows = list(csv.reader(io.StringIO(study.download("csv", decimal="comma").decode("utf-8-sig")), delimiter=";"))
        places = [rows[0].index(path) for path in paths]
        text = "\ufeff" + "\n".join(";".join(row[place] for place in places) for row in rows)
    assert "0,125;21,0" in text
    with sprag.run({**SPEC, "axes": [{"points": text}]}, processes=0) as again:
        assert {path: again.table()[path].tolist() for path in paths} == cases
