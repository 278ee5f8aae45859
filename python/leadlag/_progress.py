"""Progress of long work: tqdm's bar if tqdm is installed, otherwise a line that is rewritten. Nothing in the first two seconds."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

#: Seconds of work that need no bar.
PATIENCE = 2.0


class Bar:
    """A bar on stderr, or in the notebook; use it in a ``with`` statement."""

    def __init__(self, what: str, wanted: bool) -> None:
        self.what = what
        self.started = time.monotonic()
        self.wanted = wanted
        self.bar: Any = None
        self.line = False

    def __enter__(self) -> Callable[[float, str], None] | None:
        return self.tell if self.wanted else None

    def tell(self, done: float, text: str) -> None:
        """Shows the finished share."""
        if time.monotonic() - self.started < PATIENCE:
            return
        if self.bar is None and not self.line:
            try:
                with warnings.catch_warnings():
                    # Missing widgets of a notebook must not stop the work.
                    warnings.simplefilter("ignore")
                    from tqdm.auto import tqdm

                form = "{percentage:3.0f} %|{bar}| {elapsed}  {desc}"
                self.bar = tqdm(total=1.0, desc=self.what, bar_format=form, leave=False)
            except ImportError:
                self.line = True
        if self.bar is not None:
            self.bar.set_description_str(f"{self.what}: {text}", refresh=False)
            self.bar.update(max(0.0, min(done, 1.0) - self.bar.n))
        elif sys.stderr.isatty():
            print(f"\r{self.what} {100 * min(done, 1.0):3.0f} %  {text}\x1b[K", end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.close()
        elif self.line and sys.stderr.isatty():
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
