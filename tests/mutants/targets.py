"""What is mutated, and which tests must notice: declared once, the most safety-relevant first."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """Modules that keep one promise.

    Parameters
    ----------
    title : str
        The promise, in a few words.
    modules : dict
        File of each module, from the root, and the files of tests that must notice its mutants.
    """

    title: str
    modules: dict[str, tuple[str, ...]]


_GUARDS = (
    "tests/daq/guards",
    "tests/daq/test_catch_up.py",
    "tests/daq/test_guard_table.py",
    "tests/daq/test_guards.py",
    "tests/daq/test_panel.py",
    "tests/daq/test_plausibility.py",
)
_STOP = (
    "tests/daq/stopping",
    "tests/daq/test_release_bound.py",
    "tests/daq/test_safe_stop.py",
    "tests/daq/test_stop_eyes.py",
)
_WRITER = ("tests/drivers/test_writer_lock.py", "tests/drivers/test_writer_notice.py")
_JOURNAL = (
    "tests/recording/test_journal.py",
    "tests/recording/test_journal_chain.py",
    "tests/recording/test_journal_file.py",
    "tests/recording/test_journal_frames.py",
    "tests/recording/test_segments.py",
)
_DECISION = ("tests/evaluation/test_decision.py", "tests/evaluation/test_judgement.py")
_SETTINGS = (
    "tests/foundation/test_bounds.py",
    "tests/foundation/test_settings.py",
    "tests/foundation/test_wrong_key.py",
)

PARTS = (
    Part(
        "guards",
        {
            f"daq/guards/{name}.py": _GUARDS
            for name in (
                "panel",
                "guard",
                "margin",
                "trips",
                *(
                    f"kinds/{kind}"
                    for kind in (
                        "channel",
                        "controller",
                        "temperature",
                        "silence",
                        "recorder",
                        "rate",
                        "clock",
                        "agreement",
                        "frozen",
                        "missed_cycles",
                        "plausibility",
                        "status_force",
                    )
                ),
            )
        },
    ),
    Part(
        "safe stop",
        {f"daq/motions/{name}.py": _STOP for name in ("safe_stop", "stop_observer", "release_bound")},
    ),
    Part(
        "lock and watchdog",
        {
            "drivers/controllers/writer_lock.py": _WRITER,
            "drivers/controllers/writer_notice.py": _WRITER,
            "drivers/controllers/outage_limit.py": ("tests/drivers/test_outage_limit.py",),
            "foundation/operating_system/locks.py": ("tests/foundation/test_locks.py",),
        },
    ),
    Part("journal", {f"recording/journal/{name}.py": _JOURNAL for name in ("file", "records", "segments")}),
    Part(
        "seal",
        {
            f"recording/sealing/{name}.py": (
                "tests/recording/test_sealing.py",
                "tests/recording/test_verify.py",
            )
            for name in ("journal_outline", "seal_journal", "verification")
        },
    ),
    Part(
        "decision rules",
        {f"evaluation/requirements/{name}.py": _DECISION for name in ("decision", "judgement")},
    ),
    Part(
        "bounds of settings",
        {
            "foundation/settings/bounds.py": _SETTINGS,
            "protocols/bounded_numbers.py": ("tests/protocols/test_bounded_numbers.py",),
            "drivers/instruments/bounded_numbers.py": ("tests/drivers/test_bounded_numbers.py",),
        },
    ),
)
MODULES = {module: tests for part in PARTS for module, tests in part.modules.items()}
