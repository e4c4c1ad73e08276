"""The first campaign, specimen and checklist as texts."""

from __future__ import annotations

import json

from bufferstand.cli.beginning.answers import Answers

CHECKLIST = """\
# What is looked at before a stand moves: the desk asks for each at every start. Write your own.
items = [
  "hall clear, nobody inside the barrier",
  "hydraulic oil at temperature, hoses tight",
  "specimen seated, guide free",
  "emergency stop tried",
]
"""
_HEAD = """\
# {about}
# Every key is explained in docs/keys.md; `bufferstand plan {file}` shows what comes of it.

[campaign]
id = {id}
title = {title}
stand = "stand.toml"
specimen = {specimen}
operator = {operator}

[conditions]
ambient_C = 21.0            # of the hall; the plan starts from it

[limits]
force_max_kN = {force:.1f}
temperature_stop_C = 40.0   # of any thermometer on the specimen
temperature_resume_C = 30.0
"""
_STEPS = {
    "en15551": """
# Passes at once if the spring is cool enough already.
[[step]]
kind = "cool-down"
name = "into the temperature range"
temperature_C = 22.0
timeout_s = 14400.0

# Three cycles, at most 50 mm/s, pauses of at most 10 minutes, 15 to 25 °C at the start.
[[step]]
kind = "static"
purpose = "conformity"
name = "three cycles"
speed_mm_per_s = 5.0
force_limit_kN = {force:.1f}
cycles = 3
pause_s = 60.0
start_temperature_C = [15.0, 25.0]
""",
    "sweeps": """
# First what needs a cool spring.
[[step]]
kind = "static"
name = "quasi-static, three cycles"
speed_mm_per_s = 5.0
force_limit_kN = {force:.1f}
cycles = 3
pause_s = 10.0

# The paper's Fig. 6: constant amplitude, growing speed.
[[step]]
kind = "sweep"
name = "constant amplitude"
prestress_mm = [20.0]
amplitude_mm = [20.0]
peak_speed_mm_per_s = [10.0, 20.0, 40.0, 80.0, 160.0]
cycles = 5

# The paper's Fig. 7: constant peak speed, amplitude and with it frequency vary.
[[step]]
kind = "sweep"
name = "constant peak speed"
prestress_mm = [50.0]
amplitude_mm = [30.0, 15.0, 10.0, 5.0]
peak_speed_mm_per_s = [80.0]
cycles = 5
""",
    "warm-up": """
# The cold spring.
[[step]]
kind = "static"
purpose = "characterisation"
name = "quasi-static, cold"
speed_mm_per_s = 5.0
force_limit_kN = {force:.1f}
cycles = 1

# The same stroke over and over warms it (the paper's Figs. 11 and 12): every cycle is recorded.
[[step]]
kind = "harmonic"
name = "warming up"
prestress_mm = 20.0
amplitude_mm = 15.0
frequency_Hz = 0.8
cycles = 400

# The warm one, at once: in a pause it would cool.
[[step]]
kind = "static"
purpose = "characterisation"
name = "quasi-static, warm"
speed_mm_per_s = 5.0
force_limit_kN = {force:.1f}
cycles = 1
""",
}
_TITLES = {
    "en15551": "Static characteristic, EN 15551",
    "sweeps": "Stiffness characteristics, sweeps",
    "warm-up": "Warm-up study",
}


def campaign_text(answers: Answers, file: str, specimen_path: str) -> str:
    """Return the text of the first campaign file.

    Parameters
    ----------
    answers : Answers
    file : str
        Its name, for the comments.
    specimen_path : str
        The specimen file from there.
    """
    title = _TITLES[answers.campaign]
    text = _HEAD + _STEPS[answers.campaign]
    return text.format(
        about=f"{title}, as `bufferstand init` wrote it.",
        file=file,
        id=quoted(answers.campaign),
        title=quoted(title),
        specimen=quoted(specimen_path),
        operator=quoted(answers.operator),
        force=min(answers.force_max_kN, 600.0),
    )


def specimen_text(answers: Answers, model_path: str) -> str:
    """Return the text of the first specimen file; every key is explained in docs/keys.md."""
    category = [f"category = {quoted(answers.category)}"] if answers.category else []
    if answers.model:
        model = [
            "# Not this specimen's own: a shipped elastomer spring, so that force and heat can be planned.",
            "# Once yours is measured: `bufferstand model fit RUNS… --out MODEL.toml`; then name that file.",
            f"model = {quoted(model_path)}",
        ]
    else:
        model = [
            "# Once it is identified (`bufferstand model fit`), the plan knows force and heat:",
            '# model = "…"',
        ]
    lines = [
        f"# Specimen {' '.join(answers.specimen.split())}; every key is explained in docs/keys.md.",
        "",
        "[specimen]",
        f"id = {quoted(answers.specimen)}",
        f"kind = {quoted(answers.kind)}",
        *category,
        f"max_stroke_mm = {answers.max_stroke_mm:.1f}",
        f"elastic_system = {quoted(answers.elastic_system)}",
        "# EN 15551 wants rubber and elastomer to rest before the first static test; when it was assembled:",
        "# assembled = 2026-01-12T08:00:00Z",
        *model,
    ]
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """Return a text as TOML: what JSON writes of a text is a basic string, but for one character."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
