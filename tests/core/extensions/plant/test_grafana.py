"""The queries of the Grafana dashboard say what the archive on a server holds."""

import json
from collections.abc import Mapping
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import psycopg
import pytest
from benchmarks.plant_view import dashboard_queries
from benchmarks.postgres_server import Postgres
from tests.core.archive.conftest import NOON, Station

from lightpen_extensions.plant.server import deliver, open_server

VALUES = {
    "pen": "LP-04",
    "tip": "T-10",
    "days": 90,
    "ahead": 14,
    "hours": 72,
    "__from": 0,
    "__to": int(datetime(2100, 1, 1, tzinfo=UTC).timestamp() * 1000),
}


@pytest.fixture(scope="module")
def queries() -> Mapping[str, str]:
    return dashboard_queries(VALUES)


def test_each_query_of_the_dashboard_says_what_was_entered(
    postgres: Postgres, station: Station, queries: Mapping[str, str]
) -> None:
    address = postgres.new_database()
    station.enter(3)
    with closing(open_server(address)) as server:
        deliver(station.database, station.chain, server)
    auditor = postgres.new_role(address, "lightpen_auditor")
    with psycopg.connect(auditor) as connection:
        rows = {
            title: connection.execute(sql.encode()).fetchall()
            for title, sql in queries.items()
        }

    last = NOON.replace(minute=2)
    (due,) = rows["Due tips"]
    assert due[:4] == ("LP-04", "T-10", "Hall 2", last)
    assert (due[4] - last).days == 90
    assert rows["Verdicts per station"] == [("Hall 2", 3, 0, 0)]
    assert rows["Silent stations"] == [("Hall 2", last)]
    uncertainties, drift = (rows[each] for each in queries if "$pen" in each)
    assert [row[1] for row in uncertainties] == [0.002, 0.002, 0.002]
    assert [row[1:] for row in drift] == [(float(n), 0.0, 0.0) for n in range(3)]


def test_the_dashboard_has_a_source_that_is_chosen() -> None:
    file = Path(__file__).parents[4] / "docs" / "grafana" / "plant.json"
    content: dict[str, Any] = json.loads(file.read_text("utf-8"))

    for panel in content["panels"]:
        assert panel["datasource"]["uid"] == "${source}"
    assert content["templating"]["list"][0]["type"] == "datasource"
