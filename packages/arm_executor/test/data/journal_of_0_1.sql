PRAGMA user_version = 2;
BEGIN TRANSACTION;
CREATE TABLE attempt (
    id INTEGER PRIMARY KEY AUTOINCREMENT,
    box_id TEXT NOT NULL,
    bin_serial INTEGER NOT NULL REFERENCES bin (serial),
    goal_id BLOB NOT NULL,
    placed TEXT NOT NULL,
    target TEXT NOT NULL,
    measured TEXT,
    step TEXT NOT NULL
);
INSERT INTO "attempt" VALUES(1,'ö "1"',1,X'07070707070707070707070707070707','{"box": {"id": "\u00f6 \"1\"", "size_mm": [300.5, 200.25, 100.0], "weight_kg": 2.5, "com_offset_mm": [0.1, 0.2, -0.3], "allowed_up": 16, "max_top_load_n": 12.5, "destination": "Oslo", "size_stddev_mm": [2.0, 1.5, 0.5], "extra": [["row", "7"]]}, "corner_mm": [0, 0, 0], "size_mm": [210, 310, 100], "orientation": "yxz", "measured_mm": null}','[[0.105, 0.155, 0.05], [0.0, 0.0, 0.7071067811865476, 0.7071067811865476]]','[[0.103, 0.152, 0.0501], [0.0, 0.0, 0.6, 0.8]]','verified');
INSERT INTO "attempt" VALUES(2,'box-2',1,X'08080808080808080808080808080808','{"box": {"id": "box-2", "size_mm": [296.0, 196.0, 150.0], "weight_kg": 3.0, "com_offset_mm": [0.0, 0.0, 0.0], "allowed_up": 63, "max_top_load_n": null, "destination": "", "size_stddev_mm": [0.0, 0.0, 0.0], "extra": []}, "corner_mm": [0, 310, 0], "size_mm": [300, 200, 150], "orientation": "xyz", "measured_mm": null}','[[0.15, 0.41, 0.075], [0.0, 0.0, 0.0, 1.0]]',NULL,'picked');
CREATE TABLE bin (
    serial INTEGER PRIMARY KEY,
    id TEXT NOT NULL UNIQUE,
    type TEXT NOT NULL,
    size_mm TEXT NOT NULL,
    station TEXT NOT NULL,
    destination TEXT NOT NULL,
    revision INTEGER NOT NULL,
    opened_s REAL NOT NULL,
    closed_s REAL
);
INSERT INTO "bin" VALUES(1,'RC-1','RC','[1200, 700, 1600]','A','',2,1700000000.0,NULL);
CREATE TABLE event (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    stamp_s REAL NOT NULL,
    box_id TEXT NOT NULL,
    event INTEGER NOT NULL,
    reason INTEGER NOT NULL,
    text TEXT NOT NULL,
    bin_id TEXT NOT NULL,
    bin_serial INTEGER NOT NULL
);
INSERT INTO "event" VALUES(1,1.70000000000000190737e+09,'ö "1"',1,0,'','',0);
INSERT INTO "event" VALUES(2,1.70000000000000476836e+09,'ö "1"',2,0,'','RC-1',1);
INSERT INTO "event" VALUES(3,1.70000000000000667569e+09,'box-2',1,0,'','',0);
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL);
INSERT INTO "meta" VALUES('config','{"bin_type": "RC", "bin_size_mm": [1200, 700, 1600], "profile.name": "cell", "profile.resolution_mm": 10, "profile.resolution_z_mm": 1, "profile.clearance_mm": 4.0, "profile.orientations": "upright", "profile.min_vertices": 3, "profile.support_tolerance_mm": 2, "profile.com_margin_mm": 15.0, "profile.min_support_share": 0.5, "profile.max_payload_kg": 20.0, "profile.max_bin_weight_kg": 500.0, "profile.check_top_load": true, "profile.size_sigmas": 2.0}');
INSERT INTO "meta" VALUES('revision','2');
CREATE TABLE step (attempt INTEGER NOT NULL, step TEXT NOT NULL, stamp_s REAL NOT NULL);
INSERT INTO "step" VALUES(1,'planned',1.7000000000000009537e+09);
INSERT INTO "step" VALUES(1,'picked',1.70000000000000190737e+09);
INSERT INTO "step" VALUES(1,'releasing',1.70000000000000286103e+09);
INSERT INTO "step" VALUES(1,'placed',1.7000000000000038147e+09);
INSERT INTO "step" VALUES(1,'verified',1.70000000000000476836e+09);
INSERT INTO "step" VALUES(2,'planned',1.70000000000000572202e+09);
INSERT INTO "step" VALUES(2,'picked',1.70000000000000667569e+09);
CREATE UNIQUE INDEX box_in_one_bin ON attempt (box_id)
    WHERE step IN ('releasing', 'placed', 'verified');
CREATE INDEX attempt_of_bin ON attempt (bin_serial);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('attempt',2);
INSERT INTO "sqlite_sequence" VALUES('event',3);
COMMIT;
