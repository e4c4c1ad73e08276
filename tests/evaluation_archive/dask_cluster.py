"""A real Dask cluster on loopback: scheduler and workers as processes of their own, to be killed for real."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from socket import socket

import distributed

ROOT = Path(__file__).resolve().parents[2]


def free_port() -> int:
    with socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class DaskCluster:
    """Processes of a cluster; everything that was started is ended by :meth:`close`."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.scheduler: subprocess.Popen[bytes] | None = None
        self.workers: list[subprocess.Popen[bytes]] = []
        self._folder = folder
        self._started = 0

    def start_scheduler(self, environment: Mapping[str, str] | None = None) -> None:
        options = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--no-jupyter"]
        options += ["--idle-timeout", "300 s"]  # should the tests be killed themselves
        self.scheduler = self._start(["scheduler", *options], environment or {})
        deadline = time.monotonic() + 60.0
        while time.monotonic() < deadline:
            with socket() as probe:
                if probe.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.1)
        raise AssertionError("the scheduler did not start")

    def start_worker(
        self,
        environment: Mapping[str, str] | None = None,
        *,
        nanny: bool = False,
        folder: Path | None = None,
    ) -> subprocess.Popen[bytes]:
        options = ["--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard", "--memory-limit", "0"]
        options += ["--death-timeout", "30"]
        options += ["--nanny"] if nanny else ["--no-nanny"]
        values = {"OPENBLAS_NUM_THREADS": "1", **(environment or {})}
        worker = self._start(["worker", self.address, *options], values, folder)
        self.workers.append(worker)
        return worker

    def workers_known(self) -> int:
        """Return how many workers the scheduler knows."""
        with distributed.Client(self.address) as client:
            return len(client.scheduler_info(n_workers=-1)["workers"])

    def _start(
        self, arguments: list[str], environment: Mapping[str, str], folder: Path | None = None
    ) -> subprocess.Popen[bytes]:
        self._started += 1
        values = {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "DASK_DISTRIBUTED__SCHEDULER__WORKER_SATURATION": "inf",
        }
        log = (self._folder / f"dask-{self._started}.log").open("wb")
        with log:
            return subprocess.Popen(
                [sys.executable, "-P", "-m", "dask", *arguments],
                env={**values, **environment},
                cwd=folder or self._folder,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """Kill a process and its children at once, as a power cut would."""
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            if process is not None:
                self.kill(process)


@contextmanager
def dask_cluster(folder: Path, workers: int) -> Iterator[DaskCluster]:
    cluster = DaskCluster(folder)
    try:
        cluster.start_scheduler()
        for _ in range(workers):
            cluster.start_worker()
        yield cluster
    finally:
        cluster.close()
