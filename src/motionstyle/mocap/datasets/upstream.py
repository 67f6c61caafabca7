"""One file by HTTPS: retries, truncated bodies and redirects, with a reason for every failure."""

from __future__ import annotations

import time
from collections.abc import Callable
from http.client import HTTPException, IncompleteRead
from urllib.error import HTTPError, URLError
from urllib.request import OpenerDirector, Request, build_opener

RETRIES = 2
_MAY_PASS = {408, 425, 429, 500, 502, 503, 504}


class SourceError(Exception):
    """One source did not give the file.

    `again` says whether a second try may help; `expected` that this is an everyday matter (a
    file not yet cached, a mirror not at hand), of which the log need not speak.
    """

    def __init__(self, reason: str, *, again: bool = False, expected: bool = False) -> None:
        super().__init__(reason)
        self.again = again
        self.expected = expected


def download(
    url: str,
    *,
    timeout_s: float,
    pause_s: float,
    log: Callable[[str], None],
    opener: OpenerDirector | None = None,
) -> tuple[bytes, str]:
    """Return the body of `url` and a remark: where a redirect led, or an empty string.

    Truncated bodies, time-outs, refused connections and passing server errors are tried
    `RETRIES` times more, after `pause_s` seconds and after twice as long.

    Raises
    ------
    SourceError
        With the reason of the last try and the number of tries.
    """
    opener = opener or build_opener()
    for attempt in range(RETRIES + 1):
        try:
            return _once(url, opener, timeout_s)
        except SourceError as failure:
            if not failure.again:
                raise
            if attempt == RETRIES:
                raise SourceError(f"{failure} ({attempt + 1} tries)") from failure
            log(f"{url}: {failure}; trying again")
            time.sleep(pause_s * 2**attempt)
    raise AssertionError("unreachable")


def _once(url: str, opener: OpenerDirector, timeout_s: float) -> tuple[bytes, str]:
    request = Request(url, headers={"User-Agent": "motionstyle"})
    try:
        with opener.open(request, timeout=timeout_s) as response:
            declared = response.headers.get("Content-Length")
            told = "" if response.url == url else f" (redirected to {response.url})"
            data = response.read()
    except HTTPError as error:
        with error:
            raise SourceError(_status(error), again=error.code in _MAY_PASS) from error
    except IncompleteRead as error:
        got, missing = len(error.partial), error.expected
        size = f"{got} of {got + missing} bytes" if missing is not None else f"{got} bytes"
        raise SourceError(f"truncated download: {size} came", again=True) from error
    except TimeoutError as error:
        raise SourceError(f"no answer within {timeout_s:g} s", again=True) from error
    except URLError as error:
        if isinstance(error.reason, TimeoutError):
            raise SourceError(f"no answer within {timeout_s:g} s", again=True) from error
        raise SourceError(f"no connection: {error.reason}", again=True) from error
    except (HTTPException, OSError, ValueError) as error:
        reason = str(error) or type(error).__name__
        raise SourceError(
            f"connection broken: {reason}", again=not isinstance(error, ValueError)
        ) from error
    if declared is not None and declared.isdigit() and int(declared) != len(data):
        reason = f"truncated download: {len(data)} of {declared} bytes came"
        raise SourceError(reason, again=True)
    return data, told


def _status(error: HTTPError) -> str:
    reason = f"HTTP {error.code} {error.msg}".strip().splitlines()[0]
    if 300 <= error.code < 400:
        target = error.headers.get("Location") or "no address"
        return f"{reason}: a redirect that leads nowhere ({target}); was the repository moved?"
    if error.code in {403, 429}:
        return f"{reason}: the host refuses; wait, or look at the proxy settings"
    if error.code == 404:
        return f"{reason}: the commit or the path is no longer there"
    return reason
