"""The wheel in environments of its own, of each Python, and what lies in the user's folder meanwhile."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import zipfile
from importlib.metadata import Distribution, distribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from sprag_study.service.http.web.manual import PAGES as MANUAL_PAGES
from tests.acceptance.processes import ROOT, environment

PACKAGED = ("sprag_study/", "engine/", "worker/", "service/", "migrations/")
#: Files for those of the site of the documentation, which `make docs` builds before a release is packed.
SITE = ("index.html", "adr/0001-one.html", "figures/pages/new.png", "assets/main.1a2b.min.css", "style-hash.txt")
#: Of the sources; an environment keeps the one that it was installed with.
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
CLIENT = "<class 'sprag_study.service.client.synchronous.client.Client'>"
STUDY = {
    "sprag": 1,
    "model": "vibration-drive",
    "base": {
        "excitation": {"frequency": "20 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        "pendulums": [{"inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000, "spring_arm": 0.05}],
        "shaft": {"inertia": 2e-3},
        "clutch": {"coefficients": [0, 200, 0, 2e4]},
    },
    "run": {"duration": "12 periods", "window": ["8 periods", "12 periods"]},
    "axes": [{"path": "shaft.load", "values": ["0 N*m", "0.1 N*m", "0.2 N*m"]}],
}


def run(*command: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    kept = {name: value for name, value in environment().items() if name != "PYTHONPATH"}
    return subprocess.run(list(map(str, command)), cwd=cwd, env=kept, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built without the network of the sources of a release, which are built of a copy of the repository."""
    folder = tmp_path_factory.mktemp("wheel")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if name.startswith((*PACKAGED, "docs/", "MANIFEST.in", "README.md", "pyproject.toml")):
            target = folder / "sources" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if (ROOT / name).is_symlink():
                target.symlink_to((ROOT / name).readlink())
            else:
                target.write_bytes((ROOT / name).read_bytes())
    for name in SITE:
        target = folder / "sources" / "service" / "http" / "web" / "site" / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.touch()
    pack = f"from setuptools.build_meta import build_sdist; build_sdist({str(folder)!r})"
    done = run(sys.executable, "-c", pack, cwd=folder / "sources")
    assert done.returncode == 0, done.stderr
    (release,) = folder.glob("*.tar.gz")
    with tarfile.open(release) as archive:
        archive.extractall(folder / "release", filter="data")
    (sources,) = (folder / "release").iterdir()
    build = f"from setuptools.build_meta import build_wheel; build_wheel({str(folder)!r})"
    done = run(sys.executable, "-c", build, cwd=sources)
    assert done.returncode == 0, done.stderr
    (built,) = folder.glob("*.whl")
    return built


def python_of(minor: int) -> Path | None:
    """A Python 3.``minor`` of this machine: on the path, or one of pyenv's."""
    name = f"python3.{minor}"
    places = [shutil.which(name), *sorted((Path.home() / ".pyenv" / "versions").glob(f"3.{minor}.*/bin/{name}"))]
    for place in filter(None, places):  # a shim on the path need not lead anywhere
        if run(place, "-c", "import venv", cwd=ROOT).returncode == 0:
            return Path(place)
    return None


def base_libraries() -> list[Distribution]:
    """What the base installation needs, and what that needs; all of it is Python of any version."""
    named: dict[str, Distribution] = {}
    waiting = ["sprag-study"]
    while waiting:
        found = distribution(waiting.pop())
        for requirement in map(Requirement, found.requires or ()):
            wanted = requirement.marker is None or requirement.marker.evaluate({"extra": ""})
            if wanted and requirement.name not in named:
                named[requirement.name] = distribution(requirement.name)
                waiting.append(requirement.name)
    return list(named.values())


@pytest.mark.parametrize("minor", [11, 12, 13])
def test_the_base_installation_is_complete_in_a_clean_environment(wheel: Path, minor: int, tmp_path: Path) -> None:
    """With copies of the libraries that it names, and of nothing else."""
    python = python_of(minor)
    if python is None:
        pytest.skip(f"this machine has no Python 3.{minor}")
    subprocess.run([python, "-m", "venv", "--without-pip", tmp_path / "clean"], check=True)
    programs = tmp_path / "clean" / "bin"
    libraries = tmp_path / "clean" / "lib" / f"python3.{minor}" / "site-packages"
    for library in base_libraries():
        for file in library.files or ():
            if file.parts[0] != ".." and file.suffix != ".pyc":
                (libraries / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(file.locate(), libraries / file)
    install = [sys.executable, "-m", "pip", "--python", programs / "python", "install", "--no-index", "--no-compile"]
    done = run(*install, wheel, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    shown = run(programs / "sprag", "--version", cwd=tmp_path)
    assert (shown.returncode, shown.stdout) == (0, f"sprag {VERSION}\n"), shown.stderr
    script = (
        "import sprag_study as sprag; print(sprag.__version__, sprag.Client, sprag.preset('one_pendulum')['model'])"
    )
    done = run(programs / "python", "-c", script, cwd=tmp_path)
    assert done.stdout == f"{VERSION} {CLIENT} vibration-drive\n", done.stderr
    asked = run(programs / "sprag", "list", "--server", "http://127.0.0.1:9", cwd=tmp_path)
    assert asked.returncode == 3, asked.stderr
    assert "Traceback" not in asked.stderr


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of an environment's programs that has the wheel, and this one's libraries without its own."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    own = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    (own / "libraries.pth").write_text(sysconfig.get_path("purelib") + "\n")
    python = folder / "bin" / "python"
    install = [sys.executable, "-m", "pip", "--python", python, "install", "--no-deps", "--no-index", "--no-compile"]
    done = run(*install, "--ignore-installed", wheel, cwd=folder)
    assert done.returncode == 0, done.stderr
    where = run(
        python,
        "-c",
        "import sprag_study, sprag_study.service as service; print(service.__file__, sprag_study.__file__)",
        cwd=folder,
    )
    assert where.stdout.count(str(own)) == 2, where
    return folder / "bin"


@pytest.fixture
def hostile(tmp_path: Path) -> Path:
    """A user's folder with modules of the names that the program's packages have."""
    for name in ("worker", "engine"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('the wrong module')\n")
    for name in ("service", "migrations"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise SystemExit('the wrong package')\n")
    (tmp_path / "study.json").write_text(json.dumps(STUDY))
    return tmp_path


def test_what_lies_in_the_folder_changes_nothing(installed: Path, hostile: Path) -> None:
    """Python itself puts the folder before all others for the module, not for the command."""
    told = run(installed / "sprag", "--version", cwd=hostile)
    assert (told.returncode, told.stdout) == (0, f"sprag {VERSION}\n"), told.stderr
    done = run(
        installed / "python",
        "-m",
        "sprag_study",
        "run",
        "study.json",
        "-o",
        "rows.csv",
        "--processes",
        "1",
        cwd=hostile,
    )
    assert done.returncode == 0, done.stderr
    assert len((hostile / "rows.csv").read_text().splitlines()) == 1 + 3


def test_a_script_in_that_folder_changes_nothing(installed: Path, hostile: Path) -> None:
    script = hostile / "script.py"
    run_it = "print(len(sprag.run('study.json', processes=1)), len(sprag.engine.ENGINE_VERSION) > 0)"
    script.write_text(f"import sprag_study as sprag\n\nif __name__ == '__main__':\n    {run_it}\n")
    done = run(installed / "python", script, cwd=hostile)
    assert (done.returncode, done.stdout) == (0, "3 True\n"), done.stderr


def test_the_wheel_has_what_the_program_reads(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        (about,) = (archive.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    wanted = {
        name if name.startswith("sprag_study/") else f"sprag_study/{name}"
        for name in listed.split("\0")
        if name.startswith(PACKAGED) and not (ROOT / name).is_symlink()
    }
    assert wanted <= names, sorted(wanted - names)
    pages = {f"sprag_study/service/http/web/manual/{name}.md" for name in MANUAL_PAGES}
    assert pages <= names, sorted(pages - names)
    assert {f"sprag_study/service/http/web/site/{name}" for name in SITE} <= names
    manual = {name for name in names if ".data/data/share/man/man1/" in name}
    assert {Path(name).name for name in manual} == {page.name for page in (ROOT / "docs" / "man").iterdir()}
    assert {name.partition("/")[0] for name in names - manual if ".dist-info/" not in name} == {"sprag_study"}
    for line in ("Requires-Python: >=3.11", "Provides-Extra: server", "Provides-Extra: tables", "Keywords: "):
        assert line in about
    assert "License" not in about
    assert "# Sprag" in about
