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
    ;
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
    ;
    CREATE UNIQUE INDEX reading_supersedes ON reading (supersedes);
    CREATE INDEX reading_specimen ON reading (specimen);
    CREATE INDEX specimen_iteration ON specimen (iteration);
