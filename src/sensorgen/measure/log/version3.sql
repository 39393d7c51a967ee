    CREATE TABLE record (
        sequence INTEGER PRIMARY KEY,
        id TEXT NOT NULL UNIQUE,
        parents TEXT NOT NULL,
        kind TEXT NOT NULL,
        version INTEGER NOT NULL,
        logged_at TEXT NOT NULL,
        content TEXT NOT NULL,
        number INTEGER,
        uid TEXT,
        specimen TEXT,
        iteration INTEGER,
        design_id TEXT,
        supersedes TEXT,
        UNIQUE (kind, number)
    ) STRICT
    ;
    CREATE INDEX record_uid ON record (kind, uid, number);
    CREATE INDEX record_specimen ON record (kind, specimen, number) WHERE specimen IS NOT NULL;
    CREATE INDEX record_iteration ON record (kind, iteration, number) WHERE iteration IS NOT NULL;
    CREATE INDEX record_design ON record (kind, design_id, number) WHERE design_id IS NOT NULL;
    CREATE INDEX record_supersedes ON record (supersedes) WHERE supersedes IS NOT NULL;
    CREATE INDEX record_merges ON record (sequence) WHERE instr(parents, ',') > 0;
    CREATE TABLE head (
        only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
        sequence INTEGER NOT NULL,
        id TEXT NOT NULL
    ) STRICT
    ;
