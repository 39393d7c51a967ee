"""Tables and migrations of the log: a new file takes the same steps as an old one."""

from importlib.resources import files

APPLICATION_ID = 0x53474C47  # in the header of the file: "SGLG"


def _step(file: str, *tables: str) -> tuple[str, ...]:
    """Statements of a file, and triggers that refuse to change or delete a row of tables, for every program.

    SQLite keeps the text of a statement, spaces included, and a log is checked by it: never change a file.
    """
    statements = (files(__package__) / file).read_text("utf-8").split(";")[:-1]
    triggers = (
        f"CREATE TRIGGER {table}_no_{event.lower()} BEFORE {event} ON {table} BEGIN "
        "SELECT RAISE(ABORT, 'nothing in the log is changed or taken out: log a correction'); END"
        for table in tables
        for event in ("UPDATE", "DELETE")
    )
    return (*statements, *triggers)


STEPS = (  # migrations from each version to the next
    _step("version1.sql", "specimen", "reading"),
    _step("version2.sql", "raw_file", "batch", "print", "bench_run", "prediction"),
)
VERSION = len(STEPS)
