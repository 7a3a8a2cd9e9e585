"""SQL of the tables on a server and of the rights of its roles.

A station adds entries and reads its own; it can change nothing. A chain belongs to the
role that entered it first. Nothing on the server says how far a chain has come but the
entries themselves, so that nothing there need ever be changed.
"""

from sqlalchemy.dialects import postgresql
from sqlalchemy.schema import CreateIndex, CreateTable

from lightpen.archive.store.database import VERSION, VERSION_TABLE
from lightpen.archive.store.tables import CHAIN_WRITERS, ENTRIES, RECORDS

_HEADING = """\
-- The archive of Lightpen on PostgreSQL 13 or later. Run it once, in a database of its
-- own, as its owner:   lightpen archive server-sql | psql -v ON_ERROR_STOP=1 DATABASE
-- Each station gets its own role, and so does who reads the whole archive:
--     CREATE ROLE hall_2 LOGIN PASSWORD '...' IN ROLE lightpen_station;
--     CREATE ROLE quality LOGIN PASSWORD '...' IN ROLE lightpen_auditor;
-- A station whose role is replaced keeps its chain:
--     UPDATE archive_writers SET writer = 'hall_2_new' WHERE writer = 'hall_2';
BEGIN;
"""

_RIGHTS = f"""\
ALTER TABLE archive_writers ALTER writer SET DEFAULT current_user;
ALTER TABLE archive_entries
    ADD FOREIGN KEY (chain) REFERENCES archive_writers,
    ADD CONSTRAINT entry_hash
        CHECK (sha256 = encode(sha256(convert_to(text, 'UTF8')), 'hex')),
    -- For statistics, see docs/grafana; what is checked is the text.
    ADD grade TEXT GENERATED ALWAYS AS
        (substring(text FROM '"grade":"([^"]*)"')) STORED,
    ADD tip_mm TEXT GENERATED ALWAYS AS
        (substring(text FROM '"tip_pen_mm":\\[([^]]*)\\]')) STORED,
    ADD uncertainty_mm TEXT GENERATED ALWAYS AS
        (substring(text FROM '"expanded_uncertainty_mm":\\[([^]]*)\\]')) STORED;
CREATE INDEX archive_verdicts ON archive_entries (at_us)
    INCLUDE (station, kind, is_simulated, grade);
ALTER TABLE archive_records
    ADD CONSTRAINT record_hash
        CHECK (sha256 = encode(sha256(convert_to(text, 'UTF8')), 'hex'));
CREATE TABLE {VERSION_TABLE} (version_num VARCHAR(32) PRIMARY KEY);
INSERT INTO {VERSION_TABLE} VALUES ('{VERSION}');

DO $$ BEGIN
    CREATE ROLE lightpen_station NOLOGIN;
EXCEPTION WHEN duplicate_object THEN NULL; END $$;
DO $$ BEGIN
    CREATE ROLE lightpen_auditor NOLOGIN;
EXCEPTION WHEN duplicate_object THEN NULL; END $$;
REVOKE ALL ON archive_writers, archive_entries, archive_records, {VERSION_TABLE}
    FROM PUBLIC;
GRANT SELECT, INSERT ON archive_writers, archive_entries, archive_records
    TO lightpen_station;
GRANT SELECT ON archive_writers, archive_entries, archive_records TO lightpen_auditor;
GRANT SELECT ON {VERSION_TABLE} TO lightpen_station, lightpen_auditor;

ALTER TABLE archive_writers ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_writers TO lightpen_station
    USING (writer = current_user) WITH CHECK (writer = current_user);
CREATE POLICY audit ON archive_writers FOR SELECT TO lightpen_auditor USING (true);

ALTER TABLE archive_entries ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_entries TO lightpen_station
    USING (chain IN (SELECT chain FROM archive_writers))
    WITH CHECK (chain IN (SELECT chain FROM archive_writers));
CREATE POLICY audit ON archive_entries FOR SELECT TO lightpen_auditor USING (true);

-- A record is known by its hash: who may read an entry with it may read it.
ALTER TABLE archive_records ENABLE ROW LEVEL SECURITY;
CREATE POLICY own ON archive_records FOR SELECT TO lightpen_station USING (EXISTS (
    SELECT FROM archive_entries WHERE record_sha256 = archive_records.sha256));
CREATE POLICY new ON archive_records FOR INSERT TO lightpen_station WITH CHECK (true);
CREATE POLICY audit ON archive_records FOR SELECT TO lightpen_auditor USING (true);
COMMIT;
"""


def server_sql() -> str:
    """Return the SQL that an administrator runs once in the database of a server."""
    dialect = postgresql.dialect()  # type: ignore[no-untyped-call]
    made: list[CreateTable | CreateIndex] = []
    for table in (CHAIN_WRITERS, ENTRIES, RECORDS):
        indices = sorted(table.indexes, key=lambda index: str(index.name))
        made += [CreateTable(table), *map(CreateIndex, indices)]
    texts = (str(each.compile(dialect=dialect)).strip() + ";\n" for each in made)
    return _HEADING + "".join(texts) + _RIGHTS
