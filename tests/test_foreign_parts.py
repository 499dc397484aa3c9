"""What is used of other packages without their promise to keep it, by name, with the reason.

Each of these packages has an upper bound in pyproject.toml. numba has a test of its own
(tests/engine/compile/test_numba_contract.py).
"""

from __future__ import annotations

import ast
import importlib
import tomllib
from functools import reduce
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]

#: Package of the index, module, attributes: what it is used for, and in which file.
USED = {
    ("distributed", "distributed.client", "Client._run_on_scheduler"): (
        "a call of the scheduler with a time limit", "worker/executors/dask_link.py",
    ),
    ("distributed", "distributed.client", "AllExit"): (
        "raised where every task is done or cancelled", "worker/executors/dask_link.py",
    ),
    ("fastapi", "fastapi.dependencies.models", "Dependant"): (
        "the parameters that a route takes", "service/http/requests.py",
    ),
    ("pint", "pint.util", "UnitsContainer.items"): (
        "the root units of a unit, Unit._units", "service/reading/units.py",
    ),
    ("starlette", "starlette.middleware.gzip", "GZipResponder.apply_compression"): (
        "compression in few threads", "service/http/compression.py",
    ),
    ("typer", "typer._click.shell_completion", "CompletionItem"): (
        "what completion offers, with a help of its own", "service/cli/show.py",
    ),
    ("uvicorn", "uvicorn.protocols.http.h11_impl", "H11Protocol"): (
        "made as uvicorn makes it, and called as any protocol of asyncio", "service/http/timeouts.py",
    ),
    ("XlsxWriter", "xlsxwriter.worksheet", "Worksheet._xml_number_element"): (
        "numbers with 17 digits", "service/exports/xlsx.py",
    ),
    ("XlsxWriter", "xlsxwriter.worksheet", "Worksheet.add_table"): (
        "tables of sheets written row by row: constant_memory, table, tables", "service/exports/xlsx.py",
    ),
}  # fmt: skip

#: How the file says it, where not by the attribute's own name.
SAID = {"UnitsContainer.items": "._units.items()"}
#: Private attributes that their owners document.
DOCUMENTED = {"_asdict", "_fields", "_replace", "_exit"}


@pytest.mark.parametrize("used", USED, ids=lambda used: ".".join(used[1:]))
def test_it_is_still_there_and_still_used(used: tuple[str, str, str]) -> None:
    package, module, attribute = used
    purpose, file = USED[used]
    assert SAID.get(attribute, attribute.split(".")[-1]) in (ROOT / file).read_text(encoding="utf-8")
    try:
        reduce(getattr, attribute.split("."), importlib.import_module(module))
    except (ImportError, AttributeError) as error:
        pytest.fail(f"{package}: {error}; {file} uses it for: {purpose}")


def test_the_units_of_a_unit() -> None:
    import pint

    registry = pint.UnitRegistry()
    _factor, root = registry.get_root_units(registry.parse_units("N*m"))
    assert dict(root._units.items()) == {"gram": 1, "meter": 2, "second": -2}


def test_the_types_of_options() -> None:
    """Help calls a number N by the type of its option, an attribute that typer 0.29 has no more."""
    from sprag_study.service.cli.app import command_line

    serve = command_line().commands["serve"]
    assert {option.name for option in serve.params if option.metavar == "N"} == {"port", "processes"}


def _requirements() -> dict[str, Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    texts = [*project["dependencies"], *(text for extra in project["optional-dependencies"].values() for text in extra)]
    return {requirement.name: requirement for requirement in map(Requirement, texts) if requirement.specifier}


@pytest.mark.parametrize("package", ["numba", *sorted({package for package, _module, _attribute in USED})])
def test_its_package_is_bounded_above(package: str) -> None:
    assert any(bound.operator == "<" for bound in _requirements()[package].specifier)


def test_nothing_else_that_is_private_is_used() -> None:
    """A private attribute that no file of the project defines is another package's."""
    used: dict[str, str] = {}
    own = set(DOCUMENTED)
    for folder in ("worker", "service", "migrations"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                match node:
                    case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
                        own.add(name)
                    case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                        own.add(name)
                    case ast.Attribute(attr=name) if name.startswith("_") and not name.startswith("__"):
                        used[name] = f"{path.relative_to(ROOT)}:{node.lineno}"
    for name in DOCUMENTED | own:
        used.pop(name, None)
    assert set(used) == {"_units", "_run_on_scheduler"}, used


def test_no_other_private_module_is_imported() -> None:
    imported: dict[str, str] = {}
    for folder in ("engine", "worker", "service", "migrations", "sprag_study"):
        for path in (ROOT / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
                if isinstance(node, ast.ImportFrom):
                    names = [node.module or ""]
                private = (name for name in names if any(part.startswith("_") for part in name.split(".")))
                imported |= {name: f"{path.relative_to(ROOT)}:{node.lineno}" for name in private}
    assert set(imported) == {"__future__", "typer._click.shell_completion"}, imported
