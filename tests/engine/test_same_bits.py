"""The bits of a result do not depend on the processor: no BLAS, and no functions that libraries choose by it."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

from sprag_study import engine
from tests.worker import fakes

#: Not in the way of a case's results: the fit of a clutch, the reduction of a measured base motion, and
#: constants that are rounded to 14 digits or refined to all of theirs.
ELSEWHERE = {
    *(f"vibration_drive/{name}.py" for name in ("clutch", "measured_base", "singular_values")),
    "quadrature.py",
    "taylor/straight.py",
}
BLAS = {"matmul", "dot", "vdot", "inner", "tensordot", "einsum", "linalg", "leggauss", "convolve", "polyfit", "roots"}
#: Functions of numpy and the C library whose last bit differs between their versions.
ELEMENTARY = {
    *("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "asin", "acos", "atan", "atan2", "hypot", "dist"),
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "power", "float_power", "pow", "cbrt"),
    *("sinh", "cosh", "tanh", "arcsinh", "arccosh", "arctanh", "asinh", "acosh", "atanh", "sinc", "gamma", "erf"),
}
#: One rounded to 14 digits decides the order of a series.
ROUNDED = {
    ("vibration_drive/kernel.py", "log"),
    ("vibration_drive/integration.py", "log2"),
    ("vibration_drive/equations.py", "log2"),
}


def calls(source: str) -> set[str]:
    """What a source uses of these, powers by an operator included."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        match node:
            case ast.BinOp(op=ast.MatMult()):
                found.add("@")
            case ast.BinOp(
                left=ast.Constant(), op=ast.Pow(), right=ast.Constant() | ast.UnaryOp(operand=ast.Constant())
            ):
                pass  # a number of the source
            case ast.BinOp(op=ast.Pow()):
                found.add("**")
            case ast.Attribute(attr=name) if name in BLAS:
                found.add(name)
            case ast.Attribute(value=ast.Name(id="np" | "math"), attr=name) if name in ELEMENTARY:
                found.add(name)
    return found


def test_results_do_not_go_through_blas_or_functions_of_libraries() -> None:
    (folder,) = map(Path, engine.__path__)
    names = {path: path.relative_to(folder).as_posix() for path in folder.rglob("*.py")}
    kept = {path: name for path, name in names.items() if name not in ELSEWHERE}
    assert len(kept) > 100
    found = {(name, call) for path, name in kept.items() for call in calls(path.read_text(encoding="utf-8"))}
    assert found == ROUNDED
    source = "a @ b; np.linalg.norm(a); np.sin(a); math.exp(a); a**2; 2.0**-52; elementary.sin(a)"
    assert calls(source) == {"@", "linalg", "sin", "exp", "**"}


#: Cases of several presets, and a machine whose formulas have every function; prints a hash of each, and one of numpy's
#: and the C library's sines.
SCRIPT = """
import hashlib, json, math
import numpy as np
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.worker import models

def digest(values):
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()

found = {}
formula = (
    "200 + 40*sin(3*phi) + 9*cos(phi)*tan(0.1*sin(phi)) + asin(0.5*sin(phi)) + acos(0.5*cos(phi)) + atan(2*sin(phi))"
    " + atan2(sin(phi), 2 + cos(phi)) + sinh(sin(phi)) + cosh(cos(phi)) + tanh(sin(2*phi)) + exp(sin(phi))"
    " + log(2 + cos(phi)) + (1.5 + sin(phi))^2.7"
)
for name in ("slotter", "two_cylinder_compressor", "conveyor", "one_pendulum"):
    text = preset_text(name)
    study = parse_spec(load_spec(text[1], text[0].rpartition(".")[2])).study
    found[name] = digest(models.run_chunk(study, 0, 12).values)
    if name == "conveyor":
        document = load_spec(text[1], text[0].rpartition(".")[2])
        document["base"]["operation"] = {"quantity": "torque", "formula": formula}
        found["formula"] = digest(models.run_chunk(parse_spec(document).study, 0, 3).values)
    if name == "one_pendulum":
        document = load_spec(text[1], text[0].rpartition(".")[2])
        document["base"]["shaft"] |= {"stribeck_load": 0.05, "stribeck_speed": 3.0, "cyclic_load": 0.5}
        document["run"] = {"duration": "40 periods"}
        found["loads"] = digest(models.run_chunk(parse_spec(document).study, 0, 12).values)
angles = np.linspace(-9.0, 9.0, 999)
print(json.dumps([found, digest(np.sin(angles)), digest(np.array([math.pow(1.0 + abs(a), a) for a in angles]))]))
"""


def run(**environment: str) -> list[object]:
    """What the script prints in a process with these variables."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env={**os.environ, **environment}, check=True, capture_output=True, text=True
    )
    answer: list[object] = json.loads(done.stdout)
    return answer


def test_other_code_of_numpy_and_the_c_library_gives_the_same_bits() -> None:
    own = run()
    other = run(**fakes.of_any_processor())
    assert own[0] == other[0]
    if fakes.numpy_features():  # so the libraries did choose other code
        assert own[1:] != other[1:]
