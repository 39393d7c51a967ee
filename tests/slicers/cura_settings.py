"""Settings of a Cura whose user has been through its first start: our printer is added, no assistant has to ask.

A printer is a stack of containers, as is each of its extruders; Cura 4.13 reads them from files of these names.
"""

MACHINE, SETTING_VERSION = "ours", 19
PREFERENCES = f"""\
[general]
version = 7
accepted_user_agreement = True
last_run_version = 4.13.0

[cura]
active_machine = {MACHINE}

[info]
send_slice_info = False
asked_send_slice_info = True
automatic_update_check = False

[metadata]
setting_version = {SETTING_VERSION}
"""


def write(home, profiles, printer, quality, materials):
    """Write the files of profiles, a printer with a material on each of its tools, and preferences.

    ``materials`` are those of the extruders, by their numbers from 0; others have none.
    """
    data, settings = (home / folder / "cura" / "4.13" for folder in (".local/share", ".config"))
    files = dict(profiles)
    whole = [f"{MACHINE}_user", "empty_quality_changes", "empty_intent", f"{printer.name}_{quality}_global",
             "empty_material", "empty_variant", f"{MACHINE}_settings", printer.name]  # fmt: skip
    files[f"machine_instances/{MACHINE}.global.cfg"] = stack(MACHINE, whole, type="machine", group_id="1")
    changes(files, MACHINE, printer, machine=MACHINE)
    for k in range(len(printer.tool_numbers)):
        own = f"{printer.name}_extruder_{k}"
        name = f"{own} #2"
        parts = [f"{name}_user", "empty_quality_changes", "empty_intent", "empty_quality",
                 materials.get(k, "empty_material"), "empty_variant", f"{name}_settings", own]  # fmt: skip
        facts = {"type": "extruder_train", "machine": MACHINE, "position": k, "enabled": True}
        files[f"extruders/{file_name(name)}.extruder.cfg"] = stack(name, parts, **facts)
        changes(files, name, printer, extruder=name)
    for name, text in files.items():
        (data / name).parent.mkdir(parents=True, exist_ok=True)
        (data / name).write_text(text, "utf-8")
    settings.mkdir(parents=True)
    (settings / "cura.cfg").write_text(PREFERENCES, "utf-8")


def stack(name, containers, **facts):
    """A stack of containers, the topmost first."""
    listed = {str(k): container for k, container in enumerate(containers)}
    general = {"version": 5, "name": name, "id": name}
    return text_of(general=general, metadata={"setting_version": SETTING_VERSION, **facts}, containers=listed)


def changes(files, name, printer, **owner):
    """Empty containers for what the user and the printer change of a stack."""
    for folder, ending, facts in (("user", "user", owner), ("definition_changes", "settings", {})):
        general = {"version": 4, "name": f"{name}_{ending}", "definition": printer.name}
        metadata = {"setting_version": SETTING_VERSION, "type": folder, **facts}
        files[f"{folder}/{file_name(name)}_{ending}.inst.cfg"] = text_of(general=general, metadata=metadata, values={})


def file_name(name):
    """As Cura quotes it."""
    return name.replace(" ", "+").replace("#", "%23")


def text_of(**sections):
    """Sections of keys and values."""
    lines = {name: "".join(f"{key} = {value}\n" for key, value in of.items()) for name, of in sections.items()}
    return "\n".join(f"[{name}]\n{values}" for name, values in lines.items())
