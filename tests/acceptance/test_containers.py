"""The container recipe and the compose file: every step and every command, executed without a container engine."""

from __future__ import annotations

import re
import signal
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import psycopg
import pytest

from benchmarks.faults.harness import free_port, kill_family, until
from tests import postgres
from tests.acceptance.containers import SPARING, Image, compose, interpolated, is_sent, started_before, steps
from tests.conftest import ROOT
from tests.service.timed_spec import SPEC
from tests.worker.executors.certificates import require_openssl

RECIPE = ROOT / "examples" / "Containerfile"
COMPOSE = ROOT / "examples" / "compose.yaml"
TOKEN = "a-token-of-the-tests"
BEARER = {"Authorization": f"Bearer {TOKEN}"}


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Image:
    """The image of the recipe: its steps have been executed, one by one."""
    return Image.built(RECIPE, tmp_path_factory.mktemp("container") / "root")


@contextmanager
def going(process: subprocess.Popen[bytes], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Kill a process that is still there when the block is left; show its log where the block fails."""
    try:
        yield process
    except BaseException:
        print(log.read_text())
        raise
    finally:
        if process.poll() is None:
            kill_family(process)


def answers(address: str) -> None:
    """Wait until a service is ready for studies."""

    with httpx.Client(base_url=address, trust_env=False, timeout=600) as client:

        def ready() -> bool:
            try:
                return client.get("/readyz").status_code == 200
            except httpx.TransportError:
                return False

        until(ready, "the service answers", look=1.0)


def test_the_image_has_the_program_and_nothing_of_its_sources(image: Image) -> None:
    assert not image.path("/build").exists()
    where = image.run(["/opt/sprag/bin/python", "-c", "import sprag_study; print(sprag_study.__file__)"])
    assert where.startswith(f"{image.root}/opt/sprag/lib/")
    wheel, installation = (rest for name, rest in steps(RECIPE) if name == "RUN" and "pip" in rest)
    assert "pip wheel" in wheel
    assert '--constraint constraints.txt "$(ls /build/dist/*.whl)[postgres,cluster,oidc,traces]"' in installation
    stages = [rest for name, rest in steps(RECIPE) if name == "FROM"]
    assert [stage.partition(" AS ")[2] for stage in stages] == ["wheel", "build", ""]
    assert {name: image.environment[name] for name in ("SPRAG_DATABASE", "SPRAG_KERNEL_CACHE")} == {
        "SPRAG_DATABASE": "/var/lib/sprag/sprag.sqlite3",
        "SPRAG_KERNEL_CACHE": "/var/lib/sprag/kernels",
    }
    assert image.declared == {"VOLUME": "/var/lib/sprag", "EXPOSE": "8000", "STOPSIGNAL": "SIGTERM"}


def test_a_build_gets_what_it_needs_and_nothing_private(image: Image) -> None:
    for path in ("sprag_study/service", "service/http/web/static/common.css", "docs/guide.md", "docs/man/sprag.1"):
        assert is_sent(path), path
    private = (".git/config", ".venv/bin/python", "sprag.sqlite3", "service/studies.sqlite3-wal", "examples/.env",
               "worker/sprag.env", "engine/__pycache__/ids.pyc", "tests/conftest.py", "build/lib/x.py")  # fmt: skip
    assert [path for path in private if is_sent(path)] == []
    assert any(image.path("/opt/sprag/share/man/man1").glob("sprag.1"))
    package = next(image.path("/opt/sprag/lib").glob("python*/site-packages/sprag_study"))
    assert (package / "service" / "languages" / "uk.po").exists()


def test_its_processes_run_as_a_user_who_owns_the_volume_only(image: Image) -> None:
    assert (image.user, image.folder) == ("sprag", "/var/lib/sprag")
    if image.left_out:
        pytest.skip(f"only root can do this, so it was left out: {image.left_out}")
    (entry,) = (image.root / "etc" / "passwd").read_text().splitlines()
    assert entry.split(":")[::2][:2] == ["sprag", "10001"]
    assert entry.endswith(":/var/lib/sprag:/usr/sbin/nologin")
    assert image.path(".").stat().st_uid == 10001
    assert (image.root / "opt" / "sprag").stat().st_uid != 10001


def test_the_command_serves_with_a_token_only(image: Image, tmp_path: Path) -> None:
    log = tmp_path / "log"
    assert (image.environment["SPRAG_HOST"], image.environment["SPRAG_PORT"]) == ("0.0.0.0", "8000")
    with going(image.start(image.command, log, **SPARING, SPRAG_PORT=str(free_port())), log) as refused:
        assert refused.wait(600) == 2, log.read_text()
    assert "needs a token" in log.read_text()


def test_the_health_check_asks_where_the_service_listens(
    image: Image, certificate: tuple[Path, Path], tmp_path: Path
) -> None:
    """By TLS, at the port, host and prefix of a file; it fails where nobody answers."""
    file, port = tmp_path / "settings.toml", free_port()
    file.write_text(
        f'port = {port}\nhost = "::"\nurl_prefix = "/sprag"\n'
        f'tls_certificate = "{certificate[0]}"\ntls_key = "{certificate[1]}"\n'
    )
    # The image sets host and port; in the environment nothing means the file.
    variables = {**SPARING, "SPRAG_SETTINGS": str(file), "SPRAG_HOST": "", "SPRAG_PORT": ""}
    log = tmp_path / "log"
    with going(image.start(image.command, log, **variables, SPRAG_TOKEN=TOKEN), log) as process:
        until(
            lambda: "Sprag serves at https://" in log.read_text() or process.poll() is not None, "the service listens"
        )
        assert re.search(r"Sprag serves at https://\S+:\d+/sprag\b", log.read_text())
        image.run(image.health, **variables)
        studies = httpx.get(f"https://[::1]:{port}/sprag/api/v1/studies", trust_env=False, verify=False)
        assert studies.status_code == 401
        process.send_signal(signal.Signals[image.declared["STOPSIGNAL"]])
        assert process.wait(600) == 0, log.read_text()
    assert image.path("sprag.sqlite3").exists()
    assert "Traceback" not in log.read_text()
    with pytest.raises(AssertionError):
        image.run(image.health, **variables)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate of another name than the container's addresses, and its key."""
    require_openssl()
    folder = tmp_path_factory.mktemp("certificate")
    file, key = folder / "server.pem", folder / "server.key"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=sprag.example",
         "-keyout", str(key), "-out", str(file)],
        check=True, capture_output=True,
    )  # fmt: skip
    return file, key


def test_the_database_is_healthy_only_when_its_first_initialisation_is_over() -> None:
    """Meanwhile the image's entry point runs a temporary server, without a network, at the same socket."""
    services = compose(COMPOSE)["services"]
    kind, health, *options = services["database"]["healthcheck"]["test"]
    listening = services["database"]["command"]
    assert (kind, listening[:2]) == ("CMD", ["postgres", "-c"])
    name, _, address = listening[2].partition("=")
    asks, port = postgres.program(health), free_port()
    assert asks
    assert name == "listen_addresses"

    def healthy(server: postgres.Server) -> bool:
        place = {"PGHOST": str(server.folder), "PGPORT": str(port)}
        return subprocess.run([asks, *options], env=place, capture_output=True, check=False).returncode == 0

    with postgres.running(port=str(port), listen_addresses="''") as server:
        assert not healthy(server)
        server.stop("fast")
        server.start(port=str(port), listen_addresses=address)
        assert healthy(server)


def test_the_compose_file_is_complete() -> None:
    """Volumes, dependencies and conditions name what there is; nothing but the service is reached from outside."""
    found = compose(COMPOSE)
    services = found["services"]
    assert set(started_before(services)) == {"database", "certificates", "schema", "scheduler", "worker", "service"}
    assert {volume.partition(":")[0] for s in services.values() for volume in s["volumes"]} == set(found["volumes"])
    for service in services.values():
        for name, rule in service.get("depends_on", {}).items():
            other = services[name]
            match rule["condition"]:
                case "service_healthy":
                    assert other["healthcheck"]["test"]
                case "service_completed_successfully":
                    assert other["restart"] == "no"
                case condition:
                    assert condition == "service_started"
    assert {name: s["ports"] for name, s in services.items() if "ports" in s} == {"service": ["127.0.0.1:8000:8000"]}
    own = [service for name, service in services.items() if name != "database"]
    assert all(s["cap_drop"] == ["ALL"] and s["init"] and s["image"] == "sprag" for s in own)
    build = own[0]["build"]
    assert (COMPOSE.parent / build["context"]).resolve() == ROOT
    assert (COMPOSE.parent / build["context"] / build["dockerfile"]).resolve() == RECIPE
    # From outside its container the socket is the only way in.
    assert services["database"]["command"] == ["postgres", "-c", "listen_addresses=127.0.0.1"]
    with_socket = {name for name, s in services.items() if any("database-socket" in v for v in s["volumes"])}
    assert with_socket == {"database", "schema", "service"}


@dataclass
class Composed:
    """The services of the compose file, with addresses and folders of this test."""

    services: dict[str, Any]
    image: Image
    moved: dict[str, str]
    more: dict[str, str]

    def here(self, text: str) -> str:
        for name, own in self.moved.items():
            text = text.replace(name, own)
        return interpolated(text, {"SPRAG_TOKEN": TOKEN})

    def command(self, name: str) -> list[str]:
        # One worker suffices here.
        words = [self.here(word) for word in self.services[name].get("command", self.image.command)]
        return ["1" if word == "-1" else word for word in words]

    def variables(self, name: str, **more: str) -> dict[str, str]:
        own = {key: self.here(value) for key, value in self.services[name]["environment"].items()}
        return {**SPARING, **own, **self.more, **more}

    def run(self, name: str) -> str:
        return self.image.run(self.command(name), **self.variables(name))


def makes_certificates_once(composed: Composed) -> None:
    composed.run("certificates")
    folder = composed.image.path("tls")
    keys = sorted(folder.glob("*.key"))
    assert [key.stem for key in keys] == ["client", "scheduler", "worker"]
    assert all(stat.S_IMODE(key.stat().st_mode) == 0o600 for key in keys)
    before = (folder / "ca.pem").read_bytes()
    composed.run("certificates")
    assert (folder / "ca.pem").read_bytes() == before


def runs_a_study(address: str) -> None:
    answers(address)
    with httpx.Client(base_url=f"{address}/api/v1", headers=BEARER, trust_env=False, timeout=600) as client:
        study = client.post("/studies", json=SPEC).json()["id"]
        with client.stream("GET", f"/studies/{study}/events") as events:
            assert "event: end" in events.iter_lines()
        assert client.get(f"/studies/{study}").json()["state"] == "finished"
        (dispatcher,) = client.get("/workers").json()["dispatchers"]
        assert (dispatcher["executor"], dispatcher["refused"]) == ("dask", [])
        assert dispatcher["scheduler"].startswith("tls://")


def test_the_commands_of_the_compose_file_run_one_by_one(image: Image, tmp_path: Path) -> None:
    """In the order of their dependencies, against a real server and with a real cluster; a study ends."""
    services = compose(COMPOSE)["services"]
    head, port = free_port(), free_port()
    database = free_port()
    with postgres.running(port=str(database), listen_addresses="127.0.0.1") as server:
        with psycopg.connect(
            host=str(server.folder), port=database, user="sprag", dbname="postgres", autocommit=True
        ) as connection:
            connection.execute("CREATE DATABASE sprag")
        moved = {
            "/var/run/postgresql": str(server.folder),
            "scheduler:8786": f"127.0.0.1:{head}",
            "8786": str(head),
        }
        composed = Composed(services, image, moved, {"PGPORT": str(database)})
        started: dict[str, subprocess.Popen[bytes]] = {}
        try:
            for name in started_before(services):
                log = tmp_path / f"{name}.log"
                match name:
                    case "database":  # the image of another project; what asks whether it is healthy is here
                        kind, health, *options = services[name]["healthcheck"]["test"]
                        asks = postgres.program(health)
                        assert kind == "CMD"
                        assert asks
                        subprocess.run([asks, *options], env={"PGPORT": str(database)}, check=True)
                    case "certificates":
                        makes_certificates_once(composed)
                    case "schema":
                        assert "from revision none" in composed.run(name)
                    case _:
                        variables = composed.variables(name, SPRAG_PORT=str(port))
                        started[name] = image.start(composed.command(name), log, **variables)
            assert set(started) == {"scheduler", "worker", "service"}
            runs_a_study(f"http://127.0.0.1:{port}")
            image.run(image.health, **composed.variables("service", SPRAG_PORT=str(port)))
            started["service"].send_signal(signal.SIGTERM)
            assert started["service"].wait(600) == 0
        except BaseException:
            for log in tmp_path.glob("*.log"):
                print(log.read_text())
            raise
        finally:
            for process in started.values():
                if process.poll() is None:
                    kill_family(process)
