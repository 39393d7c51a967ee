    CREATE TABLE raw_file (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        name TEXT NOT NULL,
        size INTEGER NOT NULL
    ) STRICT
    ;
    CREATE TABLE batch (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        batch TEXT NOT NULL,
        file TEXT NOT NULL REFERENCES raw_file (uid)
    ) STRICT
    ;
    CREATE TABLE print (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        specimen TEXT NOT NULL REFERENCES specimen (specimen),
        batch_uid TEXT NOT NULL REFERENCES batch (uid),
        design_id TEXT NOT NULL,
        design TEXT NOT NULL
    ) STRICT
    ;
    CREATE INDEX print_specimen ON print (specimen);
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
    ;
    CREATE UNIQUE INDEX bench_run_supersedes ON bench_run (supersedes);
    CREATE INDEX bench_run_specimen ON bench_run (specimen);
    CREATE TABLE prediction (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        design_id TEXT NOT NULL,
        design TEXT NOT NULL,
        version TEXT NOT NULL,
        data TEXT NOT NULL
    ) STRICT
    ;
    CREATE INDEX prediction_design ON prediction (design_id);
    ALTER TABLE reading ADD COLUMN design_id TEXT NOT NULL DEFAULT '';
    ALTER TABLE reading ADD COLUMN design TEXT NOT NULL DEFAULT '';
    ALTER TABLE reading ADD COLUMN batch TEXT NOT NULL DEFAULT '';
