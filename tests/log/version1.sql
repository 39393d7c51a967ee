PRAGMA application_id = 1397181511;
PRAGMA user_version = 1;
BEGIN TRANSACTION;
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
INSERT INTO "reading" VALUES(1,'514a9f00b78164a7efa69f739e100d76','2025-03-01T10:00:00.000+00:00','23 triX','23 triX','','thesis Table D.1',NULL,'0.68k','45','[680.0]','[45.0]',NULL,'[]','','',12);
INSERT INTO "reading" VALUES(2,'fea044c17782397fec42ae04de3200b2','2025-03-01T10:00:00.000+00:00','23 triY .1mm xfine','23 triY .1mm xfine','not baked','thesis Table D.1',NULL,'75k','1.1m','[75000.0]','[1100000.0]',0,'["''xfine'' read as extrafine", "z: ''1.1m'': m read as mega (milli would be below the contact resistance)"]','','',36);
INSERT INTO "reading" VALUES(3,'54d177dd9a08a5605ae135da782dd92b','2025-03-01T10:00:00.000+00:00','23 sqXY .1mm 3','23 sqXY .1mm 3','big holes','thesis Table D.1',NULL,'2.5k / 3k','5k / 0','[2500.0, 3000.0]','[5000.0, 0.0]',NULL,'["y: 2 readings: repeats, or several points of contact", "z: 0 ohm: a short circuit, or a reading below the meter''s resolution", "z: 2 readings: repeats, or several points of contact"]','','',48);
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
INSERT INTO "specimen" VALUES('23 triX',23,'tri','X',0.0,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('23 triY .1mm xfine',23,'tri','Y',0.1,NULL,NULL,'xfine','');
INSERT INTO "specimen" VALUES('23 sqXY .1mm 3',23,'rect','XY',0.1,NULL,3,'','');
CREATE UNIQUE INDEX reading_supersedes ON reading (supersedes);
CREATE INDEX reading_specimen ON reading (specimen);
CREATE INDEX specimen_iteration ON specimen (iteration);
CREATE TRIGGER specimen_no_update BEFORE UPDATE ON specimen BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER specimen_no_delete BEFORE DELETE ON specimen BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER reading_no_update BEFORE UPDATE ON reading BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER reading_no_delete BEFORE DELETE ON reading BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
COMMIT;
