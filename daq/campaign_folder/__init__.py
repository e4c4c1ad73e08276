"""The campaign's folder: its record, its inputs, how it was started, and what was run."""

from typing import TYPE_CHECKING

from bufferstand.foundation import loaded_when_used

if TYPE_CHECKING:
    from bufferstand.daq.campaign_folder.as_run import (
        AS_RUN_NAME,
        REPORT_HEADER,
        AsRun,
        ExpectedOutcome,
        add_as_run,
        observed_run,
        read_as_run,
        replaced_sentence,
        report_rows,
        rows_in_force,
        totals,
    )
    from bufferstand.daq.campaign_folder.changes import (
        SERIAL,
        StartChange,
        controller_changes,
        file_changes,
        software_changes,
    )
    from bufferstand.daq.campaign_folder.first_start import (
        CampaignStart,
        begun,
        software_version,
        with_doubt,
        with_stand,
    )
    from bufferstand.daq.campaign_folder.folder import (
        RECORD_NAME,
        RUNS_NAME,
        CampaignFolder,
        CampaignRecord,
        CampaignStatus,
        begin_record,
        load_record,
    )
    from bufferstand.daq.campaign_folder.inputs import (
        INPUTS_NAME,
        FileEdit,
        Inputs,
        edits_between,
        keep_before,
        read_inputs,
        restore_inputs,
    )
    from bufferstand.daq.campaign_folder.run_metadata import (
        CampaignMetadata,
        run_document,
        stream_document,
    )
    from bufferstand.daq.campaign_folder.stand_origin import (
        OWN_WORD,
        REAL,
        WAITS,
        StandOrigin,
        another,
        how_reached,
        mixing,
    )
    from bufferstand.daq.campaign_folder.start_records import (
        begin,
        changes_taken,
        doubts_before,
        edits_taken,
        left_to_do,
        take_edits,
    )
    from bufferstand.daq.campaign_folder.step_matching import (
        same_steps,
    )

__all__ = [
    "AS_RUN_NAME",
    "INPUTS_NAME",
    "OWN_WORD",
    "REAL",
    "RECORD_NAME",
    "REPORT_HEADER",
    "RUNS_NAME",
    "SERIAL",
    "WAITS",
    "AsRun",
    "CampaignFolder",
    "CampaignMetadata",
    "CampaignRecord",
    "CampaignStart",
    "CampaignStatus",
    "ExpectedOutcome",
    "FileEdit",
    "Inputs",
    "StandOrigin",
    "StartChange",
    "add_as_run",
    "another",
    "begin",
    "begin_record",
    "begun",
    "changes_taken",
    "controller_changes",
    "doubts_before",
    "edits_between",
    "edits_taken",
    "file_changes",
    "how_reached",
    "keep_before",
    "left_to_do",
    "load_record",
    "mixing",
    "observed_run",
    "read_as_run",
    "read_inputs",
    "replaced_sentence",
    "report_rows",
    "restore_inputs",
    "rows_in_force",
    "run_document",
    "same_steps",
    "software_changes",
    "software_version",
    "stream_document",
    "take_edits",
    "totals",
    "with_doubt",
    "with_stand",
]

__getattr__, __dir__ = loaded_when_used(__name__, __file__)
