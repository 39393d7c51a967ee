PRAGMA application_id = 1397181511;
PRAGMA user_version = 2;
BEGIN TRANSACTION;
CREATE TABLE batch (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        batch TEXT NOT NULL,
        file TEXT NOT NULL REFERENCES raw_file (uid)
    ) STRICT
    ;
INSERT INTO "batch" VALUES(1,'a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef','2026-11-22T10:31:22.722+00:00','26','a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef');
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
INSERT INTO "bench_run" VALUES(1,'eb8ec399ae2d15c4f86b89b48e5543b5','2026-11-22T10:31:22.869+00:00','26 triX .1mm','26 triX .1mm','aaaaaaaaaaaaaaaa','trix-d0.1','26','first','run.csv',NULL,'ec7c4fa1dbe44f6289c44cb8276393d2bec04993d8ad1f11b82bb4b8e56e5a31','1d6264f7b0ae6ec8cda94e1b8ec34e55eb7468b0cb443ce63d2ec510852ca6c7','{"columns": {"t": "time_s"}, "lockins": [{"bandwidth_hz": null, "counts": {"clipped": 0, "gap": 0, "invalid": 0, "missing": 0, "no stamp": 0, "repeated stamp": 0, "reversed stamp": 0, "rig error": 7, "samples": 575, "transient": 0, "valid": 568, "zero": 0}, "epoch_s": null, "format": "CSV", "lockin": 1, "notes": [], "program": "", "rate_hz": 19.999999999999716, "seconds": 28.7, "tones_hz": [1100.0, 99700.0]}], "rig": {"clocks": "rig''s clock + -1661419318.5152 +- 0.012 s", "errors": 1, "explained": 0.9660922490651896, "notes": ["3 samples while the rig was silent"], "offset_error_s": 0.011979823493262076, "offset_s": -1661419318.515213, "rows": 144, "samples": 7, "skew": 0.0, "skew_error": 0.0010885856649279128}, "rig_columns": {}}');
INSERT INTO "bench_run" VALUES(2,'304704dce0f51488034faad0395fb4c6','2026-11-22T10:31:22.893+00:00','26 triX .1mm 2','26 triX .1mm 2','aaaaaaaaaaaaaaaa','trix-d0.1','26','','alone.mat',NULL,'792fe96a55de963f539355d95ad088248d4e4865880eaa2bf6e8a2534fdf7e6f',NULL,'{"columns": {}, "lockins": [{"bandwidth_hz": 10.0, "counts": {"clipped": 0, "gap": 0, "invalid": 0, "missing": 0, "no stamp": 0, "repeated stamp": 0, "reversed stamp": 0, "rig error": 0, "samples": 40, "transient": 4, "valid": 36, "zero": 0}, "epoch_s": 1661419320.0287554, "format": "MATLAB 5", "lockin": 1, "notes": [], "program": "TiePieLCR V1.0.3", "rate_hz": 19.999999999999982, "seconds": 1.95, "tones_hz": [1100.0, 2300.0, 5300.0, 10100.0, 19900.0, 49900.0, 99700.0]}]}');
INSERT INTO "bench_run" VALUES(3,'ab80e5f6c5cba86a7a847af480efe213','2026-11-22T10:31:22.927+00:00','26 triX .1mm 2','26 triX .1mm 2','aaaaaaaaaaaaaaaa','trix-d0.1','26','second lead','alone.mat','304704dce0f51488034faad0395fb4c6','792fe96a55de963f539355d95ad088248d4e4865880eaa2bf6e8a2534fdf7e6f',NULL,'{"columns": {}, "lockins": [{"bandwidth_hz": 10.0, "counts": {"clipped": 0, "gap": 0, "invalid": 0, "missing": 0, "no stamp": 0, "repeated stamp": 0, "reversed stamp": 0, "rig error": 0, "samples": 40, "transient": 4, "valid": 36, "zero": 0}, "epoch_s": 1661419320.0287554, "format": "MATLAB 5", "lockin": 1, "notes": [], "program": "TiePieLCR V1.0.3", "rate_hz": 19.999999999999982, "seconds": 1.95, "tones_hz": [1100.0, 2300.0, 5300.0, 10100.0, 19900.0, 49900.0, 99700.0]}]}');
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
INSERT INTO "prediction" VALUES(1,'1bd99ca738b71367cf91765e5713d2133b4e08b6e75de03f94e2c1a92a8b887e','2026-11-22T10:31:22.722+00:00','aaaaaaaaaaaaaaaa','trix-d0.1','0.1.0','{"capacitance_f": {"lower": 1e-11, "upper": 2e-11}, "electrode_resistance_ohm": {"bottom": 6666.7, "top": 2333.3}, "printed": {"prusa": {"capacitance_f": {"drawn": {"lower": 1e-11}}}}}');
INSERT INTO "prediction" VALUES(2,'ddde7e7653767ef23499fcdc0098b152b7535c067d470cfe873f67bed87e13f5','2026-11-22T10:31:22.724+00:00','bbbbbbbbbbbbbbbb','triy-d0.1','0.1.0','{"capacitance_f": null, "reason": "electrodes touch"}');
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
INSERT INTO "print" VALUES(1,'a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef 26 triX .1mm','2026-11-22T10:31:22.722+00:00','26 triX .1mm','a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef','aaaaaaaaaaaaaaaa','trix-d0.1');
INSERT INTO "print" VALUES(2,'a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef 26 triX .1mm 2','2026-11-22T10:31:22.722+00:00','26 triX .1mm 2','a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef','aaaaaaaaaaaaaaaa','trix-d0.1');
CREATE TABLE raw_file (
        number INTEGER PRIMARY KEY,
        uid TEXT NOT NULL UNIQUE,
        logged_at TEXT NOT NULL,
        name TEXT NOT NULL,
        size INTEGER NOT NULL
    ) STRICT
    ;
INSERT INTO "raw_file" VALUES(1,'a20cc4f490ceacb5bd40ef39b8b370239c752f84486c86fc9cbfa9e21be1bdef','2026-11-22T10:31:22.722+00:00','batch.json',561);
INSERT INTO "raw_file" VALUES(2,'ec7c4fa1dbe44f6289c44cb8276393d2bec04993d8ad1f11b82bb4b8e56e5a31','2026-11-22T10:31:22.869+00:00','run.csv',25445);
INSERT INTO "raw_file" VALUES(3,'1d6264f7b0ae6ec8cda94e1b8ec34e55eb7468b0cb443ce63d2ec510852ca6c7','2026-11-22T10:31:22.869+00:00','rig.csv',5427);
INSERT INTO "raw_file" VALUES(4,'792fe96a55de963f539355d95ad088248d4e4865880eaa2bf6e8a2534fdf7e6f','2026-11-22T10:31:22.893+00:00','alone.mat',5063);
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
    , design_id TEXT NOT NULL DEFAULT '', design TEXT NOT NULL DEFAULT '', batch TEXT NOT NULL DEFAULT '') STRICT
    ;
INSERT INTO "reading" VALUES(1,'95f3e5660be8cafdfafbddd0c29f1c9a','2026-11-22T10:31:22.692+00:00','19 SQXY','19 sqXY','','thesis Table D.1',NULL,'0.9K','0','[900.0]','[0.0]',NULL,'["upper case read as the usual spelling", "no film named: none", "y: ''0.9K'': upper-case K read as kilo", "z: 0 ohm: a short circuit, or a reading below the meter''s resolution"]','','',1,'953a89f40f4faca2','sqxy-d0','');
INSERT INTO "reading" VALUES(2,'514a9f00b78164a7efa69f739e100d76','2026-11-22T10:31:22.692+00:00','23 triX','23 triX','','thesis Table D.1',NULL,'0.68k','45','[680.0]','[45.0]',NULL,'[]','','',12,'9a407830c951d4c0','trix-d0','');
INSERT INTO "reading" VALUES(3,'fea044c17782397fec42ae04de3200b2','2026-11-22T10:31:22.692+00:00','23 triY .1mm xfine','23 triY .1mm xfine','not baked','thesis Table D.1',NULL,'75k','1.1m','[75000.0]','[1100000.0]',0,'["''xfine'' read as extrafine", "z: ''1.1m'': m read as mega (milli would be below the contact resistance)"]','','',36,'6542430c9da9e4ea','triy-d0.1-extrafine','');
INSERT INTO "reading" VALUES(4,'54d177dd9a08a5605ae135da782dd92b','2026-11-22T10:31:22.692+00:00','23 sqXY .1mm 3','23 sqXY .1mm 3','big holes','thesis Table D.1',NULL,'2.5k / 3k','5k / 0','[2500.0, 3000.0]','[5000.0, 0.0]',NULL,'["y: 2 readings: repeats, or several points of contact", "z: 0 ohm: a short circuit, or a reading below the meter''s resolution", "z: 2 readings: repeats, or several points of contact"]','','',48,'4512eafa126325f3','sqxy-d0.1','');
INSERT INTO "reading" VALUES(5,'079a25c48969f88fe112cc652632dfda','2026-11-22T10:31:22.692+00:00','23 sqYX 0.1mm','23 sqYX .1mm','','thesis Table D.1',NULL,'','','[]','[]',NULL,'["0.1mm written .1mm", "no measurement"]','','',60,'ad3b541adec3dbbd','sqyx-d0.1','');
INSERT INTO "reading" VALUES(6,'4df39c1e50a2b489a139982b6ab716ff','2026-11-22T10:31:22.692+00:00','25 sqYX','25 sqYX','','thesis Table D.1',NULL,'0.8k / 2.3k','8.5k / 10.5k','[800.0, 2300.0]','[8500.0, 10500.0]',NULL,'["y: 2 readings: repeats, or several points of contact", "z: 2 readings: repeats, or several points of contact"]','','',69,'758b0f9ef3bc29a1','sqyx-d0','');
INSERT INTO "reading" VALUES(7,'3fc897c7289b4501af104d672e29bf47','2026-11-22T10:31:22.730+00:00','26 triX .1mm','26 triX .1mm','=a leads slipped
again','typed',NULL,'0.65','OL','[0.65]','[9e999]',1,'["y: ''0.65'': 0.65 ohm is less than leads and contacts have; a k lost?"]','4 May','',NULL,'aaaaaaaaaaaaaaaa','trix-d0.1','26');
INSERT INTO "reading" VALUES(8,'6a32e12035fc4831aedde82e31754509','2026-11-22T10:31:22.732+00:00','26 triX .1mm','26 triX .1mm','','GPIB0::22::INSTR','3fc897c7289b4501af104d672e29bf47','0.65k / 0.7k','>1G','[650.0, 700.0]','[9e999]',NULL,'["y: 2 readings: repeats, or several points of contact", "z: ''>1G'' taken for overload"]','','HP 34401A (x)',NULL,'aaaaaaaaaaaaaaaa','trix-d0.1','26');
INSERT INTO "reading" VALUES(9,'c2dc8a75144a4d42a943c66968197647','2026-11-22T10:31:22.742+00:00','22 triY 10mm','22 triY 10mm','not baked','typed',NULL,'1.1m','','[1100000.0]','[]',0,'["10mm is too thick for a film: taken for another size, the film is unknown", "y: ''1.1m'': m read as mega (milli would be below the contact resistance)"]','','',NULL,'','','');
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
INSERT INTO "specimen" VALUES('19 sqXY',19,'rect','XY',0.0,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('23 triX',23,'tri','X',0.0,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('23 triY .1mm xfine',23,'tri','Y',0.1,NULL,NULL,'xfine','');
INSERT INTO "specimen" VALUES('23 sqXY .1mm 3',23,'rect','XY',0.1,NULL,3,'','');
INSERT INTO "specimen" VALUES('23 sqYX .1mm',23,'rect','YX',0.1,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('25 sqYX',25,'rect','YX',0.0,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('26 triX .1mm',26,'tri','X',0.1,NULL,NULL,'','');
INSERT INTO "specimen" VALUES('26 triX .1mm 2',26,'tri','X',0.1,NULL,2,'','');
INSERT INTO "specimen" VALUES('22 triY 10mm',22,'tri','Y',NULL,10.0,NULL,'','');
CREATE UNIQUE INDEX reading_supersedes ON reading (supersedes);
CREATE INDEX reading_specimen ON reading (specimen);
CREATE INDEX specimen_iteration ON specimen (iteration);
CREATE TRIGGER specimen_no_update BEFORE UPDATE ON specimen BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER specimen_no_delete BEFORE DELETE ON specimen BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER reading_no_update BEFORE UPDATE ON reading BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER reading_no_delete BEFORE DELETE ON reading BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE INDEX print_specimen ON print (specimen);
CREATE UNIQUE INDEX bench_run_supersedes ON bench_run (supersedes);
CREATE INDEX bench_run_specimen ON bench_run (specimen);
CREATE INDEX prediction_design ON prediction (design_id);
CREATE TRIGGER raw_file_no_update BEFORE UPDATE ON raw_file BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER raw_file_no_delete BEFORE DELETE ON raw_file BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER batch_no_update BEFORE UPDATE ON batch BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER batch_no_delete BEFORE DELETE ON batch BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER print_no_update BEFORE UPDATE ON print BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER print_no_delete BEFORE DELETE ON print BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER bench_run_no_update BEFORE UPDATE ON bench_run BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER bench_run_no_delete BEFORE DELETE ON bench_run BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER prediction_no_update BEFORE UPDATE ON prediction BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
CREATE TRIGGER prediction_no_delete BEFORE DELETE ON prediction BEGIN SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END;
COMMIT;
