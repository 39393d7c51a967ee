"""Tables and migrations of the log: a new file takes the same steps as an old one."""

APPLICATION_ID = 0x53474C47  # in the header of the file: "SGLG"

_READINGS = (
    """
    CREATE TABLE specimen (
        specimen TEXT PRIMARY KEY,
        iteration INTEGER,
        shape TEXT NOT NULL,
        axes TEXT NOT NULL,
        film_mm REAL,
        size_mm REAL,
        replicate INTEGER,
        slicing TEXT NOT NULL,
        place TEXT NOT NULL
    ) STRICT
    """,
    """
    CREATE TABLE reading (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        written TEXT NOT NULL,
        specimen TEXT NOT NULL REFERENCES specimen (specimen),
        remark TEXT NOT NULL,
        source TEXT NOT NULL,
        supersedes TEXT REFERENCES reading (uid),
        y_words TEXT NOT NULL,
        z_words TEXT NOT NULL,
        y_ohm TEXT NOT NULL,
        z_ohm TEXT NOT NULL,
        baked INTEGER CHECK (baked IN (0, 1)),
        doubts TEXT NOT NULL,
        measured_at TEXT NOT NULL,
        instrument TEXT NOT NULL,
        source_row INTEGER
    ) STRICT
    """,
    "CREATE UNIQUE INDEX reading_supersedes ON reading (supersedes)",
    "CREATE INDEX reading_specimen ON reading (specimen)",
    "CREATE INDEX specimen_iteration ON specimen (iteration)",
)

_BENCH_AND_BATCHES = (
    """
    CREATE TABLE raw_file (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        name TEXT NOT NULL,
        size INTEGER NOT NULL
    ) STRICT
    """,
    """
    CREATE TABLE batch (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        batch TEXT NOT NULL,
        file TEXT NOT NULL REFERENCES raw_file (uid)
    ) STRICT
    """,
    """
    CREATE TABLE print (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        specimen TEXT NOT NULL REFERENCES specimen (specimen),
        batch_uid TEXT NOT NULL REFERENCES batch (uid),
        design_id TEXT NOT NULL,
        design TEXT NOT NULL
    ) STRICT
    """,
    "CREATE INDEX print_specimen ON print (specimen)",
    """
    CREATE TABLE bench_run (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        written TEXT NOT NULL,
        specimen TEXT NOT NULL REFERENCES specimen (specimen),
        design_id TEXT NOT NULL,
        design TEXT NOT NULL,
        batch TEXT NOT NULL,
        remark TEXT NOT NULL,
        source TEXT NOT NULL,
        supersedes TEXT REFERENCES bench_run (uid),
        file TEXT NOT NULL REFERENCES raw_file (uid),
        rig_file TEXT REFERENCES raw_file (uid),
        facts TEXT NOT NULL
    ) STRICT
    """,
    "CREATE UNIQUE INDEX bench_run_supersedes ON bench_run (supersedes)",
    "CREATE INDEX bench_run_specimen ON bench_run (specimen)",
    """
    CREATE TABLE prediction (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        design_id TEXT NOT NULL,
        design TEXT NOT NULL,
        version TEXT NOT NULL,
        data TEXT NOT NULL
    ) STRICT
    """,
    "CREATE INDEX prediction_design ON prediction (design_id)",
    "ALTER TABLE reading ADD COLUMN design_id TEXT NOT NULL DEFAULT ''",
    "ALTER TABLE reading ADD COLUMN design TEXT NOT NULL DEFAULT ''",
    "ALTER TABLE reading ADD COLUMN batch TEXT NOT NULL DEFAULT ''",
)


def _append_only(*tables: str) -> tuple[str, ...]:
    """Triggers that refuse to change or delete a row, for every program."""
    return tuple(
        f"CREATE TRIGGER {table}_no_{event.lower()} BEFORE {event} ON {table} BEGIN "
        "SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END"
        for table in tables
        for event in ("UPDATE", "DELETE")
    )


STEPS = (  # migrations from each version to the next
    (*_READINGS, *_append_only("specimen", "reading")),
    (*_BENCH_AND_BATCHES, *_append_only("raw_file", "batch", "print", "bench_run", "prediction")),
)
VERSION = len(STEPS)
