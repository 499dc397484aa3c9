"""A stand-in for curl on machines without it: just the options that the README uses."""

from __future__ import annotations

import sys
from pathlib import Path

import httpx


def main(arguments: list[str]) -> int:
    """Send the request and write the answer as curl would."""
    method, target, written, after, body, url = None, None, False, None, None, ""
    data: list[tuple[str, str]] = []
    queue = list(arguments)
    while queue:
        option = queue.pop(0)
        if option == "-sS":
            continue
        if option == "-G":
            written = True
        elif option in ("-d", "--data-urlencode"):
            name, _, value = queue.pop(0).partition("=")
            data.append((name, value))
        elif option == "-X":
            method = queue.pop(0)
        elif option == "-o":
            target = queue.pop(0)
        elif option == "-w":
            after = queue.pop(0)
        elif option == "--json":
            text = queue.pop(0)
            body = Path(text[1:]).read_bytes() if text.startswith("@") else text.encode()
        else:
            url = option
    headers = {} if body is None else {"Content-Type": "application/json"}
    method = method or ("GET" if body is None else "POST")
    answer = httpx.request(
        method, url, params=data if written else None, content=body, headers=headers, timeout=600, trust_env=False
    )
    if target is None:
        sys.stdout.buffer.write(answer.content)
    else:
        Path(target).write_bytes(answer.content)
    if after == "%header{location}":
        sys.stdout.write(answer.headers["location"])
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
