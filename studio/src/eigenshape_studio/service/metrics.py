"""What the service counts, for Prometheus."""

from collections.abc import Callable, Collection
from typing import Any

from prometheus_client import (
    CollectorRegistry,
    Counter,
    Gauge,
    Histogram,
    ProcessCollector,
    generate_latest,
)

from eigenshape_studio.guard import App, Message, Receive, Scope, Send

# Seconds: a mesh of 9,000 vertices takes about 1; the default limit is 60.
DESCRIBING = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)
SEARCHING = (0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # seconds
OTHER = "other"  # the path of requests that are for none of ours


class Metrics:
    """Counters of one service.

    Parameters
    ----------
    n_shapes : callable
        Called when the metrics are read.
    """

    def __init__(self, n_shapes: Callable[[], int]) -> None:
        self._registry = CollectorRegistry()
        ProcessCollector(registry=self._registry)
        kind: Any = {"registry": self._registry}
        self.requests = Counter(
            "eigenshape_requests", "Requests that were answered.", ["path", "status"], **kind
        )
        self.describing = Histogram(
            "eigenshape_describe_seconds",
            "Seconds from an upload to its description, with waiting for a worker.",
            buckets=DESCRIBING,
            **kind,
        )
        self.searching = Histogram(
            "eigenshape_search_seconds", "Seconds of searching.", buckets=SEARCHING, **kind
        )
        self.queue = Gauge("eigenshape_queue", "Queries that wait or run.", **kind)
        Gauge("eigenshape_shapes", "Shapes in the index.", **kind).set_function(n_shapes)

    def text(self) -> bytes:
        """Return all of it in the text format of Prometheus."""
        return generate_latest(self._registry)


def count_requests(app: App, metrics: Metrics, templates: Collection[str]) -> App:
    """Return an application that counts what another answers.

    Parameters
    ----------
    app : App
    metrics : Metrics
    templates : collection of str
        Paths, of which each may end in one parameter such as {name}.
    """
    beginnings = {path.partition("{")[0]: path for path in templates if "{" in path}

    def template_of(path: str) -> str:
        if path in templates:
            return path
        found = [whole for begin, whole in beginnings.items() if path.startswith(begin)]
        return found[0] if found else OTHER

    async def counted(scope: Scope, receive: Receive, send: Send) -> None:
        async def count(message: Message) -> None:
            if message["type"] == "http.response.start":
                labels = template_of(scope["path"]), str(message["status"])
                metrics.requests.labels(*labels).inc()
            await send(message)

        await app(scope, receive, count)

    return counted
